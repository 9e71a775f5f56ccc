// Checks of lost leases, and of jobs that fail because of them.
//
// A lease is lost only after its grant was sent, and only if its worker or stream had a fault since. A job fails for
// losses only after as many workers in a row as CoordinatorLimits states were lost with one of its tiles or its pilot.
// The count here, from grants, losses and results, may be higher: the coordinator does not count losses of a worker
// that sends garbage.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/domain/effects.h"
#include "tests/simulation/stream.h"
#include "tests/simulation/world.h"

namespace lightmill::simulation {

class ServerSide;
class WorkerSide;

/// Part of the reason of a job that fails for losses.
inline constexpr std::string_view kLostInARow = "lost in a row";

class LossChecks {
 public:
  LossChecks(World& world, const ServerSide& server, const WorkerSide& workers)
      : world_(world), server_(server), workers_(workers) {}

  void server_starts();
  void hello_came(const std::shared_ptr<Stream>& stream, const WorkerHello& hello);
  /// Like Checks::check_effects.
  void check(const Effects& effects);
  /// No worker loses a lease that was not sent. Call it after the messages that need no commit were sent.
  void check_sent(const Effects& effects);
  /// A message is sent.
  void sent(const std::shared_ptr<Stream>& stream, const Outgoing& message);

 private:
  /// Work of a lease. A pilot has no tiles.
  struct Lent {
    JobId job;
    std::vector<TileId> tiles;
    SampleRange range;
    bool audits = false;
    bool lost = false;                     ///< its worker may still come back with it
    bool alone = false;                    ///< a suspect pilot, or one tile and no other lease
    SessionId since;                       ///< session that it was granted to, or first came with
    std::shared_ptr<const Stream> stream;  ///< stream that it was last sent on, or came on; null until then
    Time left;                             ///< when it was sent
  };
  /// Workers that were lost in a row with the same tile or pilot.
  struct Row {
    std::uint32_t lost = 0;
    std::pair<std::string, SessionId> last;
    std::vector<std::string> alone;
  };
  /// A tile of a job, or its pilot if there is no tile.
  using Work = std::pair<JobId, std::optional<TileId>>;

  void note_results(const Effects& effects);
  void count_loss(const Note& note);
  void note_grants(const Effects& effects);
  /// Whether this number of workers was lost in a row with work of the job.
  bool is_true(JobId job, const std::string& reason) const;
  void check_left(const Note& note);
  void check_failed(const JobRecord& job);
  bool is_undisturbed(const Lent& lent) const;
  bool pilot_is_suspect(JobId job) const;
  /// Whether the worker of this session holds a single lease.
  bool has_one_lease(SessionId session) const;

  World& world_;
  const ServerSide& server_;
  const WorkerSide& workers_;
  std::map<LeaseId, Lent> lent_;
  std::map<Work, Row> rows_;
  std::map<JobId, std::set<std::string>> left_;  ///< true reasons for which an identity gets no more of the job
  std::map<std::string, std::uint64_t> lives_;   ///< life of the worker's process of the last hello, by name
  std::string comes_;                            ///< the worker whose hello is handled now
  bool comes_again_ = false;                     ///< its process had connected before
};

}  // namespace lightmill::simulation

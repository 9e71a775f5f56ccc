// Checks of leases that a coordinator takes for lost, and of jobs that fail because of them.
//
// A lease is lost only after its grant has left, and only if something has befallen its worker or its stream since.
//
// A job fails for losses only if as many workers as CoordinatorLimits says were lost in a row with one of its tiles, or
// with its pilot, and the reason names them. They are counted here again, from grants, losses and results. What comes
// out may be too many: of a worker that sends garbage the coordinator counts no losses.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "server/domain/effects.h"
#include "tests/simulation/stream.h"
#include "tests/simulation/world.h"

namespace lightmill::simulation {

class ServerSide;
class WorkerSide;

/// In the reasons of jobs that fail for losses.
inline constexpr std::string_view kLostInARow = "lost in a row";

class LossChecks {
 public:
  LossChecks(World& world, const ServerSide& server, const WorkerSide& workers)
      : world_(world), server_(server), workers_(workers) {}

  void server_starts();
  void hello_came(const std::shared_ptr<Stream>& stream, const WorkerHello& hello);
  /// As Checks::check_effects.
  void check(const Effects& effects);
  /// No worker loses a lease that was not sent. To be called once messages that need no commit have left.
  void check_sent(const Effects& effects);
  /// A message leaves.
  void sent(const std::shared_ptr<Stream>& stream, const Outgoing& message);

 private:
  /// What a lease is of. A pilot has no tiles.
  struct Lent {
    JobId job;
    std::vector<TileId> tiles;
    SampleRange range;
    bool audits = false;
    bool lost = false;                     ///< perhaps its worker comes back with it
    bool alone = false;                    ///< its work was suspect when it was granted
    SessionId since;                       ///< that it was granted to, or came with first
    std::shared_ptr<const Stream> stream;  ///< that it left by last, or came by; null until then
    Time left;                             ///< when that was
  };
  /// Workers that were lost in a row with a tile or pilot.
  struct Row {
    std::uint32_t lost = 0;
    std::pair<std::string, SessionId> last;
    std::vector<std::string> alone;
  };
  /// A pilot is no tile.
  using Work = std::pair<JobId, std::optional<TileId>>;

  void note_results(const Effects& effects);
  void count_loss(const Note& note);
  void note_grants(const Effects& effects);
  void check_failed(const JobRecord& job);
  bool is_undisturbed(const Lent& lent) const;
  bool is_suspect(const Work& work) const;

  World& world_;
  const ServerSide& server_;
  const WorkerSide& workers_;
  std::map<LeaseId, Lent> lent_;
  std::map<Work, Row> rows_;
  std::map<std::string, std::uint64_t> lives_;  ///< of the worker's process that said hello last, by name
  std::string comes_;                           ///< the worker that says hello now
  bool comes_again_ = false;                    ///< its process had before
};

}  // namespace lightmill::simulation

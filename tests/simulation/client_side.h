// Client side of a simulated farm: clients that submit and change jobs, have scene files read, and repeat requests that
// were not answered.
//
// Owns the jobs as their clients know them, and the requests that are open.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "server/domain/coordinator.h"
#include "tests/simulation/world.h"

namespace lightmill::simulation {

class ServerSide;
class WorkerSide;

inline constexpr std::uint64_t kNoPoison = ~std::uint64_t{0};

struct ClientJob {
  JobSpec spec;
  MethodNotes notes;  ///< with candidates for a pilot, or without
  std::optional<JobId> id;
  std::uint64_t goal = 0;            ///< samples, with all extensions; 0: none
  double error = 0;                  ///< the same
  std::uint64_t poison = kNoPoison;  ///< from this sample on tile 0 kills its worker
  bool poisoned_pilot = false;
  bool broken = false;  ///< its scene does not compile
  bool cancel_asked = false;
  bool cancelled = false;
  bool removed = false;
};

class ClientSide {
 public:
  ClientSide(World& world, ServerSide& server, const WorkerSide& workers)
      : world_(world), server_(server), workers_(workers) {}

  void make_jobs();
  void make_race_job(const Race& race);
  const std::vector<ClientJob>& jobs() const { return jobs_; }
  /// The job that a client has submitted with these settings' seed and scene name.
  const ClientJob& job_of(const RenderSettings& settings) const;
  void submit(std::size_t index);
  void change_something();
  /// Looks at the film of one job, or of all.
  void look_at_film() { look_at_film(jobs_[world_.random.below(jobs_.size())]); }
  void look_at_films();
  bool all_ended() const;
  /// Finds out which jobs were cancelled. A client may have the answer to its first attempt, when the job was done;
  /// then the job was extended, and the second attempt cancelled it.
  void note_cancelled();
  std::string describe_farm() const;

  // ---- inspecting.cpp ----
  void make_inspections();
  void lose_inspections();
  void note_inspected(const Effects& effects);

 private:
  /// Asks until there is an answer. `ask` returns whether its answer is final once its effects are committed. It is
  /// called with the film of the job in memory, if one is given and there.
  void request(std::function<bool(Effects&)> ask, Action answered, JobId with_film_of = {});
  void look_at_film(const ClientJob& job);
  void extend(std::size_t index);
  void pause(std::size_t index);
  void quarantine(const std::string& worker);
  void cancel(std::size_t index);
  bool is_cancelled_on_disk(JobId id) const;
  std::optional<InspectionId> inspect(const std::string& caller);
  void ask_inspection();
  void ask_last_inspection();

  World& world_;
  ServerSide& server_;
  const WorkerSide& workers_;
  std::vector<ClientJob> jobs_;
  std::uint64_t open_requests_ = 0;
  std::optional<InspectionId> last_inspection_;
  std::map<InspectionId, std::string> asked_;  ///< inspections without an answer yet, and their scenes
};

}  // namespace lightmill::simulation

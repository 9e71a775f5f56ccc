// Client side of a simulated farm: clients that submit and change jobs, ask for scene files to be read, and retry
// requests.
//
// Owns the jobs as their clients know them, and the open requests.
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
  std::uint64_t poison = kNoPoison;  ///< tile 0 kills its worker from this sample on
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
  /// The submitted job with the seed and scene name of these settings.
  const ClientJob& job_of(const RenderSettings& settings) const;
  void submit(std::size_t index);
  void change_something();
  /// Uses the film of one job, or of all.
  void look_at_film() { look_at_film(jobs_[world_.random.below(jobs_.size())]); }
  void look_at_films();
  bool all_ended() const;
  /// Notes which jobs were cancelled. A client may have the answer to its first attempt, when the job was done. Then
  /// the job was extended, and the second attempt cancelled it.
  void note_cancelled();
  std::string describe_farm() const;

  // ---- inspecting.cpp ----
  void make_inspections();
  void lose_inspections();
  void note_inspected(const Effects& effects);

 private:
  /// Asks until there is an answer. `ask` returns whether its answer is final after the commit of its effects. If a job
  /// is given, `ask` is called with its film in memory.
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
  std::map<InspectionId, std::string> asked_;  ///< unanswered inspections, and their scenes
};

}  // namespace lightmill::simulation

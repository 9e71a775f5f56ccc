// Checks of what must be true in the end, of jobs, films, results and workers.
#pragma once

#include "tests/simulation/checks.h"
#include "tests/simulation/client_side.h"

namespace lightmill::simulation {

class EndChecks {
 public:
  EndChecks(World& world, ServerSide& server, const WorkerSide& workers, const ClientSide& clients)
      : world_(world), server_(server), workers_(workers), clients_(clients) {}

  void check();

 private:
  void check_job(const ClientJob& job);
  void check_method(const ClientJob& job);
  void check_film(const ClientJob& job, const JobStatus& status);
  /// Each node has been merged from results that are stored, each sample from one of them. Returns how many results are
  /// stored that have not been verified.
  std::uint64_t check_results(JobId job, TileId tile);
  /// Whether workers may have rounded differently in this job.
  bool may_be_rounded(const ClientJob& job) const;
  /// The samples that a job with a goal in error ends with, whatever happens to the farm.
  std::uint64_t count_of(const ClientJob& job, const JobStatus& status) const;

  World& world_;
  ServerSide& server_;
  const WorkerSide& workers_;
  const ClientSide& clients_;
};

}  // namespace lightmill::simulation

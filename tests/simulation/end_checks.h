// Checks of jobs, films, results and workers at the end of a run.
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
  /// Checks that each node was merged from stored results, each sample from one of them. Returns the count of stored
  /// results that were not audited.
  std::uint64_t check_results(JobId job, TileId tile);
  /// Whether the node has the bytes of a run without faults.
  bool is_right(const ClientJob& job, const JobStatus& status, TileId tile, const Node& node) const;
  /// Whether workers of this job may have rounded differently.
  bool may_be_rounded(const ClientJob& job) const;
  /// Sample count at the end of a job with an error goal. It does not depend on faults of the farm.
  std::uint64_t count_of(const ClientJob& job, const JobStatus& status) const;

  World& world_;
  ServerSide& server_;
  const WorkerSide& workers_;
  const ClientSide& clients_;
};

}  // namespace lightmill::simulation

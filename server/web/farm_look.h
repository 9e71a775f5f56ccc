// Looks at the farm's lists: which jobs and workers changed since the look before.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "server/runtime/farm_loop.h"

namespace lightmill {

struct FarmNews {
  std::vector<JobStatus> jobs;  ///< new and changed ones
  std::vector<JobId> removed;
  std::vector<WorkerStatus> workers;  ///< all
  std::vector<JobId> revived;         ///< of those asked for, which have not ended
};

/// Belongs to the farm thread.
class FarmLook {
 public:
  /// So many jobs are listed, the newest.
  static constexpr std::size_t kMostJobs = 1'000;

  /// `ended` are jobs whose coming back to life matters.
  FarmNews look(const Coordinator& farm, Time now, std::span<const JobId> ended);

 private:
  struct Known {
    std::uint64_t version = 0;
    bool active = false;
  };
  std::map<JobId, Known> known_;
  Time next_review_{};
};

}  // namespace lightmill

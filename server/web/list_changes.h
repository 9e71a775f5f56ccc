// Changes of the farm's lists of jobs and workers since the last call.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "server/runtime/farm_loop.h"

namespace lightmill {

struct ListChanges {
  std::vector<JobStatus> jobs;  ///< new and changed ones
  std::vector<JobId> removed;
  std::vector<WorkerStatus> workers;  ///< all
  std::vector<JobId> revived;         ///< jobs of `ended` that run again
};

/// Used on the farm thread.
class ListTracker {
 public:
  /// Jobs in the list. The newest ones are listed.
  static constexpr std::size_t kMaxJobs = 1'000;

  /// `ended`: ended jobs that the caller watches, in case they are resumed.
  ListChanges poll(const Coordinator& farm, Time now, std::span<const JobId> ended);

 private:
  struct Known {
    std::uint64_t version = 0;
    bool active = false;
  };
  std::map<JobId, Known> known_;
  Time next_review_{};
};

}  // namespace lightmill

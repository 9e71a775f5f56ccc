#include "server/scheduling/fair_queue.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lightmill {

void FairQueue::put(JobId job, const QueuePosition& position) {
  remove(job);
  positions_.emplace(job, position);
  order_.insert({position, job});
}

void FairQueue::remove(JobId job) {
  const auto found = positions_.find(job);
  if (found != positions_.end()) {
    order_.erase({found->second, job});
    positions_.erase(found);
  }
}

double FairQueue::starting_seconds(std::int32_t priority) const {
  // Within a priority, jobs in their first round come before the others, and each group is ascending. So two
  // look-ups are enough.
  double least = std::numeric_limits<double>::infinity(), given = 0;
  for (const bool first_round : {true, false}) {
    const auto at = order_.lower_bound({{priority, first_round, -std::numeric_limits<double>::infinity()}, JobId{0}});
    if (at != order_.end() && at->position.priority == priority && at->position.first_round == first_round) {
      given = at->position.sum() < least ? at->position.given_seconds : given;
      least = std::min(least, at->position.sum());
    }
  }
  return given;
}

}  // namespace lightmill

// In which order jobs are offered to a worker: priority first, then those whose first picture is not out, then fair
// shares.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <tuple>

#include "common/base/ids.h"

namespace lightmill {

/// What decides a job's place.
struct QueuePlace {
  std::int32_t priority = 0;  ///< higher goes first
  bool first_round = false;   ///< goes first among equals, so that every job has a picture soon
  double given_seconds =
      0;  ///< thread seconds given since it came, those of leases that are out included: fewer go first
};

/// The jobs that have work to give, in order. Changing a job's place costs O(log jobs).
class FairQueue {
 public:
  /// Puts a job in, or moves it.
  void put(JobId job, const QueuePlace& place);
  void remove(JobId job);
  bool empty() const { return order_.empty(); }
  bool contains(JobId job) const { return places_.contains(job); }
  /// What a job that comes (again) starts from: the least of those in the queue at its priority, so that it neither
  /// waits for what others had before nor starves them. 0 if there is none.
  double starting_seconds(std::int32_t priority) const;

  struct Entry {
    QueuePlace place;
    JobId job;
    friend bool operator<(const Entry& a, const Entry& b) {
      return std::tuple(-std::int64_t{a.place.priority}, !a.place.first_round, a.place.given_seconds, a.job) <
             std::tuple(-std::int64_t{b.place.priority}, !b.place.first_round, b.place.given_seconds, b.job);
    }
  };
  auto begin() const { return order_.begin(); }
  auto end() const { return order_.end(); }

 private:
  std::set<Entry> order_;
  std::map<JobId, QueuePlace> places_;
};

}  // namespace lightmill

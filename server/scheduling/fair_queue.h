// Queue of jobs in the order of their leases: by priority, then jobs without a first picture, then by fair share.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <tuple>

#include "common/base/ids.h"

namespace lightmill {

/// Sort key of a job.
struct QueuePosition {
  std::int32_t priority = 0;  ///< higher first
  bool first_round = false;   ///< first among equals, so that every job has a picture soon
  double given_seconds = 0;   ///< thread seconds since it entered, with those of open leases; fewer first
  double owed_seconds = 0;    ///< added to `given_seconds`: preparation time of its owner's jobs
  double sum() const { return given_seconds + owed_seconds; }
};

/// Jobs that have work to lease, in order. A change of a job's place costs O(log jobs).
class FairQueue {
 public:
  /// Inserts a job, or moves it.
  void put(JobId job, const QueuePosition& position);
  void remove(JobId job);
  bool empty() const { return order_.empty(); }
  bool contains(JobId job) const { return positions_.contains(job); }
  /// The job is in the queue (checked).
  const QueuePosition& position(JobId job) const { return positions_.at(job); }
  /// Start value for a job that enters: `given_seconds` of the next job of its priority, or 0. So it neither waits for
  /// the past shares of others nor starves them.
  double starting_seconds(std::int32_t priority) const;

  struct Entry {
    QueuePosition position;
    JobId job;
    friend bool operator<(const Entry& a, const Entry& b) {
      return std::tuple(-std::int64_t{a.position.priority}, !a.position.first_round, a.position.sum(), a.job) <
             std::tuple(-std::int64_t{b.position.priority}, !b.position.first_round, b.position.sum(), b.job);
    }
  };
  auto begin() const { return order_.begin(); }
  auto end() const { return order_.end(); }

 private:
  std::set<Entry> order_;
  std::map<JobId, QueuePosition> positions_;
};

}  // namespace lightmill

// What the farm did, for who looks back: its work, its workers and its queue over time. In memory alone: a coordinator
// that starts begins with nothing.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "server/domain/effects.h"

namespace lightmill {

/// The farm at one moment.
struct FarmCounts {
  std::uint64_t pixel_samples = 0;   ///< merged since the coordinator began
  std::uint32_t jobs_running = 0;    ///< of which something is leased
  std::uint32_t jobs_waiting = 0;    ///< neither ended nor paused, and nothing of them is leased
  std::vector<WorkerCount> workers;  ///< that are connected
};

/// An interval of the farm's life. What is no count of the interval is a mean over its moments.
struct FarmSample {
  std::int64_t unix_ms = 0;  ///< its end
  double seconds = 0;        ///< its length
  double pixel_samples = 0;  ///< merged in it
  double workers = 0;
  double threads = 0;
  double busy_threads = 0;  ///< of workers that have a lease
  double leases = 0;
  double jobs_running = 0, jobs_waiting = 0;
  friend bool operator==(const FarmSample&, const FarmSample&) = default;
};

/// A minute of a worker.
struct WorkerSample {
  std::int64_t unix_ms = 0;  ///< its end
  double seconds = 0;        ///< that the worker was there
  std::uint64_t results = 0, leases_lost = 0, pixel_samples = 0;
  friend bool operator==(const WorkerSample&, const WorkerSample&) = default;
};

/// Samples of ten seconds for an hour, of five minutes for a day, and each worker's last hour by minutes: 60 KB, and
/// 3 KB a worker. Not thread-safe.
class FarmHistory {
 public:
  static constexpr Duration kInterval = std::chrono::seconds(10);
  static constexpr std::size_t kFine = 360, kCoarse = 288, kMinutes = 60;
  static constexpr int kFineInCoarse = 30, kFineInMinute = 6;
  /// Names of workers beyond these are not kept until others have been gone for an hour.
  static constexpr std::size_t kMostWorkers = 20'000;

  /// When `add` is due.
  Time next() const { return next_; }
  /// Counts of this moment: ends an interval, which may be longer than kInterval.
  void add(const FarmCounts& counts, Time now, std::int64_t unix_ms);
  /// The last of what a worker did: its counts begin anew when it comes again.
  void depart(const WorkerCount& worker);

  /// Oldest first.
  const std::deque<FarmSample>& fine() const { return fine_; }
  const std::deque<FarmSample>& coarse() const { return coarse_; }
  /// The same of one worker's whole minutes; empty if it is not known.
  std::vector<WorkerSample> of_worker(const std::string& name) const;

 private:
  struct WorkerPast {
    WorkerCount last;
    WorkerSample minute;  ///< that is under way
    std::deque<WorkerSample> minutes;
    int minutes_gone = 0;
  };
  /// The minute that is under way has what the worker did since its last count; null if there is no room for it.
  WorkerPast* count(const WorkerCount& worker);
  void end_minute(std::int64_t unix_ms);

  std::deque<FarmSample> fine_, coarse_;
  std::map<std::string, WorkerPast> workers_;
  std::uint64_t pixel_samples_ = 0;
  int until_minute_ = kFineInMinute, until_coarse_ = kFineInCoarse;
  Time begun_{};
  Time next_{};
};

}  // namespace lightmill

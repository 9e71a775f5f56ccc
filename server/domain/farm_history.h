// History of the farm: its work, its workers and its queue over time. Only in memory: a coordinator starts with none.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "server/domain/effects.h"

namespace lightmill {

/// Counts of the farm at one moment.
struct FarmLoad {
  std::uint64_t pixel_samples = 0;   ///< merged since the coordinator began
  std::uint32_t jobs_running = 0;    ///< with leases
  std::uint32_t jobs_waiting = 0;    ///< without leases, neither ended nor paused
  std::vector<WorkerCount> workers;  ///< connected ones
};

/// Interval of the farm's history. `pixel_samples` is a count over the interval; the values below it are means.
struct HistorySample {
  std::int64_t unix_ms = 0;  ///< its end
  double seconds = 0;        ///< its length
  double pixel_samples = 0;  ///< merged in it
  double workers = 0;
  double threads = 0;
  double busy_threads = 0;  ///< of workers that have a lease
  double leases = 0;
  double jobs_running = 0, jobs_waiting = 0;
  friend bool operator==(const HistorySample&, const HistorySample&) = default;
};

/// Minute of a worker's history.
struct WorkerSample {
  std::int64_t unix_ms = 0;  ///< its end
  double seconds = 0;        ///< that the worker was connected
  std::uint64_t results = 0, leases_lost = 0, pixel_samples = 0;
  friend bool operator==(const WorkerSample&, const WorkerSample&) = default;
};

/// History at three scales: ten seconds for an hour, five minutes for a day, and minutes of each worker's last hour. 60
/// KB, and 4 KB for each worker. Not thread-safe.
class FarmHistory {
 public:
  static constexpr Duration kInterval = std::chrono::seconds(10);
  static constexpr std::size_t kFine = 360, kCoarse = 288, kMinutes = 60;
  static constexpr int kFineInCoarse = 30, kFineInMinute = 6;
  /// Further workers are not recorded until others have been gone for an hour.
  static constexpr std::size_t kMaxWorkers = 20'000;

  /// When `add` is due.
  Time next() const { return next_; }
  /// Ends an interval with the counts of this moment. It may be longer than kInterval.
  void add(const FarmLoad& load, Time now, std::int64_t unix_ms);
  /// Last counts of a worker that is gone. Its counts start at 0 when it comes back.
  void depart(const WorkerCount& worker);

  /// Oldest first.
  const std::deque<HistorySample>& fine() const { return fine_; }
  const std::deque<HistorySample>& coarse() const { return coarse_; }
  /// Complete minutes of a worker, oldest first; empty if it is unknown.
  std::vector<WorkerSample> of_worker(const std::string& name) const;

 private:
  struct WorkerHistory {
    WorkerCount last;
    WorkerSample minute;  ///< not complete yet
    std::deque<WorkerSample> minutes;
    int minutes_gone = 0;
  };
  /// Adds what the worker did since its last counts to its current minute. Null if there is no room for the worker.
  WorkerHistory* count(const WorkerCount& worker);
  void end_minute(std::int64_t unix_ms);

  std::deque<HistorySample> fine_, coarse_;
  std::map<std::string, WorkerHistory> workers_;
  std::uint64_t pixel_samples_ = 0;
  int until_minute_ = kFineInMinute, until_coarse_ = kFineInCoarse;
  Time begun_{};
  Time next_{};
};

}  // namespace lightmill

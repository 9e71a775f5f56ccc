#include "server/domain/farm_history.h"

#include <algorithm>

namespace lightmill {
namespace {

template <class T>
void keep_last(std::deque<T>& ring, T entry, std::size_t most) {
  ring.push_back(std::move(entry));
  if (ring.size() > most) {
    ring.pop_front();
  }
}

/// Means weighted by length, and sums of counts.
template <class Samples>
FarmSample joined(const Samples& samples) {
  FarmSample all = samples.back();
  all.seconds = all.pixel_samples = 0;
  for (const FarmSample& each : samples) {
    all.seconds += each.seconds;
    all.pixel_samples += each.pixel_samples;
  }
  for (double FarmSample::*const mean : {&FarmSample::workers, &FarmSample::threads, &FarmSample::busy_threads,
                                         &FarmSample::leases, &FarmSample::jobs_running, &FarmSample::jobs_waiting}) {
    double sum = 0;
    for (const FarmSample& each : samples) {
      sum += each.*mean * each.seconds;
    }
    all.*mean = all.seconds > 0 ? sum / all.seconds : all.*mean;
  }
  return all;
}

}  // namespace

void FarmHistory::add(const FarmCounts& counts, Time now, std::int64_t unix_ms) {
  const bool first = next_ == Time{};
  FarmSample sample;
  sample.unix_ms = unix_ms;
  sample.seconds = first ? 0 : to_seconds(now - begun_);
  sample.pixel_samples = static_cast<double>(counts.pixel_samples - pixel_samples_);
  sample.workers = static_cast<double>(counts.workers.size());
  for (const WorkerCount& worker : counts.workers) {
    sample.threads += worker.threads;
    sample.busy_threads += worker.leases > 0 ? worker.threads : 0;
    sample.leases += worker.leases;
    if (WorkerPast* const past = count(worker)) {
      past->minutes_gone = 0;
      past->minute.seconds += sample.seconds;
    }
  }
  sample.jobs_running = counts.jobs_running;
  sample.jobs_waiting = counts.jobs_waiting;
  begun_ = now;
  next_ = now + kInterval;
  pixel_samples_ = counts.pixel_samples;
  if (first) {
    return;  // the first moment is no interval yet
  }
  keep_last(fine_, sample, kFine);
  if (--until_minute_ == 0) {
    until_minute_ = kFineInMinute;
    end_minute(unix_ms);
  }
  if (--until_coarse_ == 0) {
    until_coarse_ = kFineInCoarse;
    keep_last(coarse_, joined(std::vector<FarmSample>(fine_.end() - kFineInCoarse, fine_.end())), kCoarse);
  }
}

FarmHistory::WorkerPast* FarmHistory::count(const WorkerCount& worker) {
  auto found = workers_.find(worker.name);
  if (found == workers_.end()) {
    if (workers_.size() >= kMostWorkers) {
      return nullptr;
    }
    found = workers_.try_emplace(worker.name).first;
  }
  WorkerPast& past = found->second;
  past.minute.results += worker.results - past.last.results;
  past.minute.leases_lost += worker.leases_lost - past.last.leases_lost;
  past.minute.pixel_samples += worker.pixel_samples - past.last.pixel_samples;
  past.last = worker;
  return &past;
}

void FarmHistory::depart(const WorkerCount& worker) {
  if (WorkerPast* const past = count(worker)) {
    past->last = {};
  }
}

void FarmHistory::end_minute(std::int64_t unix_ms) {
  for (auto& [name, past] : workers_) {
    past.minutes_gone += past.minute.seconds > 0 ? 0 : 1;
    past.minute.unix_ms = unix_ms;
    keep_last(past.minutes, std::exchange(past.minute, {}), kMinutes);
  }
  std::erase_if(workers_, [](const auto& entry) { return entry.second.minutes_gone >= static_cast<int>(kMinutes); });
}

std::vector<WorkerSample> FarmHistory::of_worker(const std::string& name) const {
  const auto found = workers_.find(name);
  return found == workers_.end()
             ? std::vector<WorkerSample>()
             : std::vector<WorkerSample>(found->second.minutes.begin(), found->second.minutes.end());
}

}  // namespace lightmill

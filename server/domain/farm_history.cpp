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
HistorySample joined(const Samples& samples) {
  HistorySample all = samples.back();
  all.seconds = all.pixel_samples = 0;
  for (const HistorySample& each : samples) {
    all.seconds += each.seconds;
    all.pixel_samples += each.pixel_samples;
  }
  for (double HistorySample::*const mean :
       {&HistorySample::workers, &HistorySample::threads, &HistorySample::busy_threads, &HistorySample::leases,
        &HistorySample::jobs_running, &HistorySample::jobs_waiting}) {
    double sum = 0;
    for (const HistorySample& each : samples) {
      sum += each.*mean * each.seconds;
    }
    all.*mean = all.seconds > 0 ? sum / all.seconds : all.*mean;
  }
  return all;
}

}  // namespace

void FarmHistory::add(const FarmLoad& load, Time now, std::int64_t unix_ms) {
  const bool first = next_ == Time{};
  HistorySample sample;
  sample.unix_ms = unix_ms;
  sample.seconds = first ? 0 : to_seconds(now - begun_);
  sample.pixel_samples = static_cast<double>(load.pixel_samples - pixel_samples_);
  sample.workers = static_cast<double>(load.workers.size());
  for (const WorkerCount& worker : load.workers) {
    sample.threads += worker.threads;
    sample.busy_threads += worker.leases > 0 ? worker.threads : 0;
    sample.leases += worker.leases;
    if (WorkerHistory* const history = count(worker)) {
      history->minutes_gone = 0;
      history->minute.seconds += sample.seconds;
    }
  }
  sample.jobs_running = load.jobs_running;
  sample.jobs_waiting = load.jobs_waiting;
  begun_ = now;
  next_ = now + kInterval;
  pixel_samples_ = load.pixel_samples;
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
    keep_last(coarse_, joined(std::vector<HistorySample>(fine_.end() - kFineInCoarse, fine_.end())), kCoarse);
  }
}

FarmHistory::WorkerHistory* FarmHistory::count(const WorkerCount& worker) {
  auto found = workers_.find(worker.name);
  if (found == workers_.end()) {
    if (workers_.size() >= kMaxWorkers) {
      return nullptr;
    }
    found = workers_.try_emplace(worker.name).first;
  }
  WorkerHistory& history = found->second;
  history.minute.results += worker.results - history.last.results;
  history.minute.leases_lost += worker.leases_lost - history.last.leases_lost;
  history.minute.pixel_samples += worker.pixel_samples - history.last.pixel_samples;
  history.last = worker;
  return &history;
}

void FarmHistory::depart(const WorkerCount& worker) {
  if (WorkerHistory* const history = count(worker)) {
    history->last = {};
  }
}

void FarmHistory::end_minute(std::int64_t unix_ms) {
  for (auto& [name, history] : workers_) {
    history.minutes_gone += history.minute.seconds > 0 ? 0 : 1;
    history.minute.unix_ms = unix_ms;
    keep_last(history.minutes, std::exchange(history.minute, {}), kMinutes);
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

#include "worker/shell/worker_loop.h"

#include <utility>

#include "common/base/check.h"
#include "common/base/log.h"
#include "common/base/text.h"
#include "common/security/caller.h"

namespace lightmill {
namespace {

/// Time for the last messages to be written.
constexpr Duration kExitTimeout = std::chrono::seconds(2);
/// Longest jitter. It spreads the reconnects of workers that lost the same coordinator.
constexpr Duration kMaxJitter = std::chrono::milliseconds(500);
constexpr Duration kJitterStep = std::chrono::milliseconds(10);

/// Whether another attempt may help.
bool is_passing(const Status& status) {
  switch (status.code()) {
    case StatusCode::kUnavailable:
    case StatusCode::kDeadlineExceeded:
    case StatusCode::kCancelled:
    case StatusCode::kAborted:
    case StatusCode::kUnknown:
      return true;
    default:
      return false;
  }
}

/// Another worker may render a job that exceeds this worker's limits (Preparer), or needs something that it lacks.
JobRefusal refused(const Status& status) {
  return {message_of(status),
          status.code() == StatusCode::kResourceExhausted || status.code() == StatusCode::kFailedPrecondition};
}

}  // namespace

WorkerLoop::WorkerLoop(const WorkerOptions& options, const Clock& clock)
    : clock_(clock),
      connected_(options.connected),
      refused_most_(options.session.refused_most),
      session_(options.session),
      name_in_log_(options.session.name),
      random_(std::hash<std::string>{}(options.session.name) ^ options.session.pid),
      link_(options.farm, link_handlers()),
      assets_([this](const Sha256& digest) { return link_.download(digest); }, options.asset_bytes),
      preparer_(
          assets_, options.scenes, options.scene, options.decoder,
          [this](std::shared_ptr<const JobDescription> description, Result<PreparedJob> prepared) {
            post([this, description = std::move(description), prepared = std::move(prepared)](Time now) {
              job_prepared(*description, prepared, now);
            });
          },
          [this](LeaseId lease, Result<PilotReport> report) {
            post([this, lease, report = std::move(report)](Time now) { pilot_done(lease, report, now); });
          }),
      inspector_(assets_, options.scene, {.program = options.reader, .decoder = options.decoder},
                 {[this](std::span<const Sha256> digests) { return link_.missing(digests); },
                  [this](const Sha256& digest, ByteView bytes) { return link_.upload(digest, bytes); }},
                 [this](InspectReport report) {
                   post([this, report = std::move(report)](Time) { session_.inspection_done(report, actions_); });
                 }),
      pool_(
          options.session.threads,
          [this](RenderedTile tile) {
            auto shared = std::make_shared<RenderedTile>(std::move(tile));
            post([this, shared](Time now) { tile_rendered(std::move(*shared), now); });
          },
          options.tamper) {}

LinkHandlers WorkerLoop::link_handlers() {
  LinkHandlers handlers;
  handlers.connected = [this](std::uint64_t stream, const std::string& address) {
    post([this, stream, address](Time now) {
      if (stream == stream_ && stream_open_) {
        failures_ = 0;
        spdlog::info("connected to {}", address);
        if (const auto first = std::exchange(connected_, nullptr)) {
          first();
        }
        session_.connected(now, actions_);
      }
    });
  };
  handlers.message = [this](std::uint64_t stream, CoordinatorMessage message) {
    post([this, stream, message = std::move(message)](Time now) {
      if (stream == stream_ && stream_open_) {
        if (const Welcome* const welcome = std::get_if<Welcome>(&message)) {
          troubles_.clear();
          if (welcome->worker != name_in_log_) {
            name_in_log_ = welcome->worker;
            spdlog::info("the farm knows this worker as {}", printable(name_in_log_));
          }
        }
        session_.message(message, now, actions_);
      }
    });
  };
  handlers.disconnected = [this](std::uint64_t stream, const std::string& address, const Status& status) {
    post([this, stream, address, status](Time now) {
      if (stream == stream_) {
        stream_broke(address, status, now);
      }
    });
  };
  return handlers;
}

void WorkerLoop::post(Event event) {
  const MutexLock lock(mutex_);
  events_.push_back(std::move(event));
  changed_.notify_one();
}

void WorkerLoop::drain() {
  post([this](Time now) {
    spdlog::info("draining: this worker finishes running tiles, and gives back the rest");
    session_.drain(now, actions_);
  });
}

Status WorkerLoop::run() {
  session_.start(clock_.now(), actions_);
  perform();
  for (;;) {
    open_if_due(clock_.now());
    const std::vector<Event> events = wait();
    const Time now = clock_.now();
    for (const Event& event : events) {
      event(now);
    }
    if (exit_ && (!stream_open_ || now >= *exit_by_)) {
      spdlog::info("leaving: {}", exit_->reason);
      return exit_->failed ? failed_precondition("{}", exit_->reason) : ok_status();
    }
    if (const std::optional<Time> due = session_.next_deadline(); due && *due <= now) {
      for (const auto& [ticket, cpu_seconds] : pool_.at_work()) {
        session_.at_work(ticket, cpu_seconds);
      }
      if (const std::optional<std::pair<LeaseId, double>> pilot = preparer_.pilot_at_work()) {
        session_.pilot_at_work(pilot->first, pilot->second);
      }
      session_.tick(now, actions_);
    }
    perform();
  }
}

/// Waits until there are events, or something is due.
std::vector<WorkerLoop::Event> WorkerLoop::wait() {
  std::optional<Time> due = session_.next_deadline();
  for (const std::optional<Time>& other : {open_at_, exit_by_}) {
    if (other && (!due || *other < *due)) {
      due = other;
    }
  }
  const MutexLock lock(mutex_);
  while (events_.empty()) {
    if (!due) {
      changed_.wait(mutex_);
      continue;
    }
    const Duration left = *due - clock_.now();
    if (left <= Duration::zero() ||
        changed_.wait_until(mutex_, std::chrono::steady_clock::now() + left) == std::cv_status::timeout) {
      break;
    }
  }
  return std::exchange(events_, {});
}

// ---- actions of the session ----

void WorkerLoop::perform() {
  while (!actions_.empty()) {
    for (const SessionAction& action : std::exchange(actions_, {})) {
      if (!exit_) {
        std::visit([this](const auto& each) { perform(each); }, action);
      }
    }
  }
}

void WorkerLoop::open_if_due(Time now) {
  if (open_at_ && *open_at_ <= now && !exit_) {
    open_at_.reset();
    stream_open_ = true;
    stream_ = link_.open();
  }
}

/// Uniform below a bound that grows with the failures in a row. Zero at first.
Duration WorkerLoop::jitter() {
  const Duration bound = std::min<Duration>(kMaxJitter, kJitterStep * std::min(failures_ * failures_, 100));
  random_ = random_ * 6364136223846793005u + 1442695040888963407u;
  return std::chrono::duration_cast<Duration>(bound * (static_cast<double>(random_ >> 40) / (1 << 24)));
}

void WorkerLoop::perform(const PrepareJob& action) {
  jobs_[action.description->job] = {action.description, std::nullopt};
  preparer_.add(action.description);
}

void WorkerLoop::perform(const ForgetJob& action) {
  jobs_.erase(action.job);
  preparer_.drop(action.job);
}

void WorkerLoop::perform(const RenderTile& action) {
  const auto at = jobs_.find(action.key.job);
  LM_CHECK(at != jobs_.end() && at->second.prepared, "job {} is not prepared", action.key.job.value);
  const PreparedJob& job = *at->second.prepared;
  if (action.key.tile.value >= job.grid.tile_count()) {
    perform(Exit{fmt::format("the coordinator asks for tile {} of job {}, which has {}", action.key.tile.value,
                             action.key.job.value, job.grid.tile_count()),
                 true});
    return;
  }
  const LogTrace about(action.trace, action.lease.value);
  spdlog::debug("lease {}: {} is to be rendered", action.lease.value, describe(action.key));
  pool_.add({action.ticket, action.key.range, job.grid.tile_rect(action.key.tile), job.method});
}

void WorkerLoop::perform(const SendMessage& action) {
  if (const auto* const result = std::get_if<WorkerResult>(action.message.get())) {
    const LogTrace about(result->trace, result->lease.value);
    spdlog::debug("lease {}: {} is rendered in {:.3f} s and sent", result->lease.value, describe(result->key),
                  result->seconds);
  }
  link_.send(action.message);
}

void WorkerLoop::perform(const ResultStored& action) {
  const auto& result = std::get<WorkerResult>(*action.message);
  const LogTrace about(result.trace, result.lease.value);
  spdlog::debug("lease {}: {} is stored by the coordinator", result.lease.value, describe(result.key));
}

void WorkerLoop::perform(const LogNotice& action) {
  spdlog::warn("{}", printable(action.text));
}

void WorkerLoop::perform(const Exit& action) {
  exit_ = action;
  exit_by_ = clock_.now() + (session_.status().connected ? kExitTimeout : Duration::zero());
  open_at_.reset();
  link_.close();
}

// ---- events ----

void WorkerLoop::job_prepared(const JobDescription& description, const Result<PreparedJob>& prepared, Time now) {
  const JobId job = description.job;
  const auto at = jobs_.find(job);
  if (at == jobs_.end() || at->second.description.get() != &description) {
    return;  // dropped meanwhile, or requested again
  }
  if (prepared.ok()) {
    at->second.prepared = *prepared;
    session_.job_ready(job, now, actions_);
  } else if (is_passing(prepared.status())) {
    spdlog::warn("job {} cannot be fetched now: {}", job.value, message_of(prepared.status()));
    session_.job_unavailable(job, now, actions_);
  } else {
    spdlog::error("job {} cannot be rendered: {}", job.value, message_of(prepared.status()));
    session_.job_failed(job, refused(prepared.status()), now, actions_);
  }
}

void WorkerLoop::tile_rendered(RenderedTile tile, Time now) {
  if (!tile.lacks.empty()) {
    preparer_.drop_caches();
  }
  session_.tile_rendered(std::move(tile), now, actions_);
}

void WorkerLoop::pilot_done(LeaseId lease, const Result<PilotReport>& report, Time now) {
  if (report.ok()) {
    session_.pilot_done(*report, now, actions_);
  } else if (is_passing(report.status())) {
    spdlog::warn("the scene of pilot lease {} cannot be fetched now: {}", lease.value, message_of(report.status()));
    session_.pilot_unavailable(lease, now, actions_);
  } else {
    spdlog::error("the pilot of lease {} cannot be run: {}", lease.value, message_of(report.status()));
    session_.pilot_failed(lease, refused(report.status()), now, actions_);
  }
}

void WorkerLoop::stream_broke(const std::string& address, const Status& status, Time now) {
  stream_open_ = false;
  const bool refused = is_refusal(status);
  if (!exit_) {
    log_failure(address, status, refused);
  }
  ++failures_;
  failures_ = std::min(failures_, 1'000);
  session_.disconnected(now, actions_, refused && !link_.enrols_next());
}

/// Logs each new reason.
void WorkerLoop::log_failure(const std::string& address, const Status& status, bool refused) {
  Trouble& trouble = troubles_[address];
  const std::string text = message_of(status);
  if (trouble.status == text || trouble.before == text) {
    spdlog::debug("{} {}", refused ? "refused again, by" : "still no connection to", address);
  } else if (refused) {
    trouble = {text, std::move(trouble.status), ""};
    spdlog::warn("refused by {}: {}. The worker retries with pauses of up to {:.0f} s, and logs only new reasons",
                 address, printable(text), to_seconds(refused_most_));
  } else if (!explaining_now_) {
    trouble.before = std::exchange(trouble.status, text);
    explain(address, status);
  }
}

/// Logs why there is no connection. This may take seconds. Meanwhile the session has to find another coordinator.
void WorkerLoop::explain(const std::string& address, const Status& status) {
  try {
    explaining_ = std::jthread([this, address, status] {
      post([this, address, why = link_.explain(address, status)](Time) {
        explaining_now_ = false;
        log_trouble(address, why);
      });
    });
    explaining_now_ = true;
  } catch (const std::system_error&) {  // no thread can start now
    log_trouble(address, message_of(status));
  }
}

void WorkerLoop::log_trouble(const std::string& address, const std::string& why) {
  const auto trouble = troubles_.find(address);
  if (trouble == troubles_.end()) {
    spdlog::info("connected to {} again, after a failure: {}", address, printable(why));
  } else if (trouble->second.why != why) {
    spdlog::warn("no connection to {}: {}. The worker retries, and logs only new reasons", address, printable(why));
    trouble->second.why = why;
  }
}

}  // namespace lightmill

// Clients, who repeat what was not answered.
#include <algorithm>

#include "server/domain/job_rules.h"
#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {
namespace {

const PixelRect kCrops[] = {{60, 60, 8, 8}, {0, 0, 3, 2}, {62, 10, 70, 1}, {0, 61, 2, 70}};
const std::vector<std::string> kLayers[] = {
    {}, {}, {"albedo"}, {"normal", "depth", "id"}, {"direct", "light:key", "normal", "depth", "id"}};
constexpr std::uint64_t kGoals[] = {1, 2, 3, 7, 16, 33, 64, 100};
/// The fake renderer's pictures have about 13 / samples, and its half width.
constexpr double kErrors[] = {4, 2, 1, 0.5};

/// Done, or refused because the job has ended, is so already, or is gone: what else it may answer must not happen.
bool is_settled(const Status& status) {
  return status.ok() || status.code() == StatusCode::kFailedPrecondition || status.code() == StatusCode::kNotFound;
}

}  // namespace

void FarmSimulation::make_jobs() {
  const std::size_t count = 1 + random_.below(3);
  for (std::size_t i = 0; i < count; ++i) {
    ClientJob job;
    job.spec.request_id = fmt::format("request-{}", i);
    job.spec.priority = static_cast<std::int32_t>(random_.below(2));
    job.spec.settings.scene = fmt::format("scene {}", i);
    job.spec.settings.width = 200;
    job.spec.settings.height = 200;
    job.spec.settings.crop = kCrops[random_.below(std::size(kCrops))];
    job.spec.settings.seed = random_.below(3);
    job.spec.settings.layers = *film_layers(kLayers[random_.below(std::size(kLayers))]);
    job.spec.settings.renderer_version = kRendererVersion;
    job.goal = kGoals[random_.below(std::size(kGoals))];
    if (chaos_.changes && random_.chance(0.2)) {
      job.spec.goal.seconds = random_.between(0.2, 4);
      job.goal = random_.chance(0.5) ? 0 : 200;
    }
    if (random_.chance(0.25)) {
      job.goal = random_.chance(0.3) ? kGoals[random_.below(std::size(kGoals))] : 0;
      job.error = kErrors[random_.below(std::size(kErrors))];
      job.spec.goal = {};
      job.spec.goal.error = job.error;
    }
    job.spec.goal.samples = job.goal;
    if (random_.chance(0.3)) {
      job.spec.settings.method = "auto";
      job.notes.candidates = {"path", "path:brute-force"};
    }
    if (random_.chance(0.2)) {
      job.spec.goal.adaptive = true;
      if (job.notes.candidates.empty()) {
        job.notes.candidates = {job.spec.settings.method};
      }
    }
    constexpr double kShares[] = {0, 0.3, 1};
    job.spec.verify_share = has_liars_ ? 1 : chaos_.verifies ? kShares[random_.below(std::size(kShares))] : 0;
    job.spec.allow_mixed = random_.chance(0.25);
    if (chaos_.poison && random_.chance(0.1)) {
      if (!job.notes.candidates.empty() && random_.chance(0.3)) {
        job.poisoned_pilot = true;
      } else {
        job.poison = random_.below(20);
      }
    }
    client_jobs_.push_back(std::move(job));
    // A liar that is alone cannot be found: where there is one, jobs come once all workers are there.
    const Duration first = has_liars_ ? Duration(std::chrono::milliseconds(1500)) : Duration{0};
    at(now_ + first + random_.seconds_between(0, i == 0 ? 1 : 5), [this, i] { submit(i); });
  }
}

void FarmSimulation::request(std::function<bool(Effects&)> ask, Action answered) {
  ++open_requests_;
  auto done = std::make_shared<bool>(false);
  auto attempt = std::make_shared<std::function<void()>>();
  *attempt = [this, ask = std::move(ask), answered = std::move(answered), done,
              weak = std::weak_ptr<std::function<void()>>(attempt)] {
    if (*done) {
      return;
    }
    if (coordinator_) {
      Effects effects;
      const bool settled = ask(effects);
      std::vector<Action> replies;
      if (settled) {
        replies.push_back([this, done, answered] {
          if (!std::exchange(*done, true)) {
            --open_requests_;
            answered();
          }
        });
      }
      execute(std::move(effects), std::move(replies));
    }
    // Not answered in time: ask again, the same.
    after(random_.seconds_between(0.6, 2), [again = weak.lock()] { (*again)(); });
  };
  (*attempt)();
}

void FarmSimulation::submit(std::size_t index) {
  auto id = std::make_shared<JobId>();
  request(
      [this, index, id](Effects& effects) {
        const Result<JobId> made =
            coordinator_->submit(client_jobs_[index].spec, now_, unix_ms(), effects, client_jobs_[index].notes);
        if (!made.ok()) {
          fail(fmt::format("submit: {}", message_of(made.status())));
          return false;
        }
        *id = *made;
        return true;
      },
      [this, index, id] { client_jobs_[index].id = *id; });
}

void FarmSimulation::change_something() {
  const std::size_t index = random_.below(client_jobs_.size());
  const ClientJob& job = client_jobs_[index];
  if (!job.id || job.cancelled) {
    return;
  }
  const double kind = random_.uniform();
  if (kind < 0.1 && has_liars_) {
    if (coordinator_) {
      on_server([&](Effects& effects) {
        (void)coordinator_->release_worker(workers_[random_.below(workers_.size())].name, now_, effects);
      });
    }
  } else if (kind < 0.4) {
    extend(index);
  } else if (kind < 0.7) {
    pause(index);
  } else if (kind < 0.8) {
    cancel(index);
  } else if (kind < 0.9) {
    const auto priority = static_cast<std::int32_t>(random_.below(4));
    request([this, id = *job.id, priority](
                Effects& effects) { return is_settled(coordinator_->set_priority(id, priority, now_, effects)); },
            [] {});
  } else if (kind < 0.95) {
    quarantine(workers_[random_.below(workers_.size())].name);
  } else if (coordinator_) {
    on_server([&](Effects& effects) {
      (void)coordinator_->drain_worker(workers_[random_.below(workers_.size())].name, now_, effects);
    });
  }
}

/// By hand, for a while.
void FarmSimulation::quarantine(const std::string& worker) {
  const bool render_again = random_.chance(0.5);
  request(
      [this, worker, render_again](Effects& effects) {
        return is_settled(coordinator_->quarantine_worker(worker, kByHand, render_again, now_, effects));
      },
      [this, worker] {
        inject("workers put into quarantine by hand");
        after(random_.seconds_between(0.1, 4), [this, worker] {
          request([this, worker](
                      Effects& effects) { return is_settled(coordinator_->release_worker(worker, now_, effects)); },
                  [] {});
        });
      });
}

void FarmSimulation::extend(std::size_t index) {
  if (client_jobs_[index].error > 0 && client_jobs_[index].goal > 0) {
    return;  // whether the samples are reached by then decides whether they still count
  }
  const std::uint64_t more = client_jobs_[index].goal + 1 + random_.below(80);
  const Extension to = client_jobs_[index].error > 0 ? Extension{0, client_jobs_[index].error * random_.between(0.5, 1)}
                                                     : Extension{more};
  request(
      [this, index, to](Effects& effects) {
        const Status status = coordinator_->extend(*client_jobs_[index].id, to, now_, effects);
        // Refused: an earlier attempt of this request, another extension, or time has brought it so far; or it was
        // cancelled.
        return status.ok() || status.code() == StatusCode::kInvalidArgument ||
               status.code() == StatusCode::kFailedPrecondition || status.code() == StatusCode::kNotFound;
      },
      [this, index, to] {
        ClientJob& job = client_jobs_[index];
        job.goal = std::max(job.goal, to.samples);
        job.error = job.error > 0 ? std::min(job.error, to.error) : 0;
      });
}

void FarmSimulation::pause(std::size_t index) {
  const JobId id = *client_jobs_[index].id;
  request([this, id](Effects& effects) { return is_settled(coordinator_->pause(id, now_, effects)); },
          [this, id] {
            after(random_.seconds_between(0.1, 4), [this, id] {
              request([this, id](Effects& effects) { return is_settled(coordinator_->resume(id, now_, effects)); },
                      [] {});
            });
          });
}

void FarmSimulation::cancel(std::size_t index) {
  const JobId id = *client_jobs_[index].id;
  const bool remove = random_.chance(0.5);
  request([this, id](Effects& effects) { return is_settled(coordinator_->cancel(id, now_, unix_ms(), effects)); },
          [this, index, id, remove] {
            ClientJob& job = client_jobs_[index];
            job.cancel_asked = true;
            job.cancelled = is_cancelled_on_disk(id);
            if (job.cancelled && remove) {
              request(
                  [this, id](Effects& effects) {
                    const Status status = coordinator_->remove(id, now_, effects);
                    return status.ok() || status.code() == StatusCode::kNotFound;
                  },
                  [this, index] { client_jobs_[index].removed = true; });
            }
          });
}

bool FarmSimulation::is_cancelled_on_disk(JobId id) const {
  const JobRecord* const stored = disk_.job(id);
  return stored == nullptr || stored->state == JobState::cancelled;
}

bool FarmSimulation::all_ended() const {
  if (!coordinator_ || open_requests_ > 0) {
    return false;
  }
  for (const ClientJob& job : client_jobs_) {
    if (!job.id) {
      return false;
    }
    const Result<JobStatus> status = coordinator_->status(*job.id, now_);
    if (status.ok() && status->state != JobState::done && status->state != JobState::cancelled &&
        status->state != JobState::failed) {
      return false;
    }
  }
  return true;
}

std::string FarmSimulation::describe_farm() const {
  std::string text;
  for (const ClientJob& job : client_jobs_) {
    const Result<JobStatus> status = coordinator_ && job.id ? coordinator_->status(*job.id, now_) : not_found("-");
    text += status.ok()
                ? fmt::format("\n  job {}: {}, tiles have {} to {} of {} samples, {} not verified: {}", job.id->value,
                              lightmill::name_of(status->state), status->min_tile_samples, status->max_tile_samples,
                              status->goal.samples, status->results_unverified, status->reason)
                : "\n  a job that is not there";
  }
  for (const SimulatedWorker& worker : workers_) {
    text += fmt::format("\n  {} of {}: {}", worker.name, worker.fingerprint, worker.alive ? "alive" : "dead");
    if (worker.alive) {
      const SessionStatus status = worker.session->status();
      text += fmt::format(", connected {}, draining {}, {} leases, {} tiles queued, {} rendering, {} results",
                          status.connected, status.draining, status.leases, status.tiles_queued, status.tiles_rendering,
                          status.results_unacknowledged);
    }
  }
  return text + fmt::format("\n  {} requests open", open_requests_);
}

}  // namespace lightmill::simulation

#include "tests/simulation/client_side.h"

#include <algorithm>

#include "server/domain/job_figures.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {
namespace {

const PixelRect kCrops[] = {{60, 60, 8, 8}, {0, 0, 3, 2}, {62, 10, 70, 1}, {0, 61, 2, 70}};
const std::vector<std::string> kLayers[] = {
    {}, {}, {"albedo"}, {"normal", "depth", "id"}, {"direct", "light:key", "normal", "depth", "id"}};
constexpr std::uint64_t kGoals[] = {1, 2, 3, 7, 16, 33, 64, 100};
/// The fake renderer's pictures have an error of about 13 / samples, and its half width.
constexpr double kErrors[] = {4, 2, 1, 0.5};

/// Whether a change of a job is settled: it is done, or refused because the job has ended, has this state, or is gone.
bool is_settled(const Status& status) {
  return status.ok() || status.code() == StatusCode::kFailedPrecondition || status.code() == StatusCode::kNotFound;
}

}  // namespace

void ClientSide::make_jobs() {
  const std::size_t count = 1 + world_.random.below(3);
  for (std::size_t i = 0; i < count; ++i) {
    ClientJob job;
    job.spec.request_id = fmt::format("request-{}", i);
    job.spec.priority = static_cast<std::int32_t>(world_.random.below(2));
    job.spec.settings.scene = fmt::format("scene {}", i);
    job.spec.settings.width = 200;
    job.spec.settings.height = 200;
    job.spec.settings.crop = kCrops[world_.random.below(std::size(kCrops))];
    job.spec.settings.seed = world_.random.below(3);
    job.spec.settings.layers = *film_layers(kLayers[world_.random.below(std::size(kLayers))]);
    job.spec.settings.renderer_version = kRendererVersion;
    job.goal = kGoals[world_.random.below(std::size(kGoals))];
    if (world_.chaos.changes && world_.random.chance(0.2)) {
      job.spec.goal.seconds = world_.random.between(0.2, 4);
      job.goal = world_.random.chance(0.5) ? 0 : 200;
    }
    if (world_.random.chance(0.25)) {
      job.goal = world_.random.chance(0.3) ? kGoals[world_.random.below(std::size(kGoals))] : 0;
      job.error = kErrors[world_.random.below(std::size(kErrors))];
      job.spec.goal = {};
      job.spec.goal.error = job.error;
    }
    job.spec.goal.samples = job.goal;
    if (world_.random.chance(0.3)) {
      job.spec.settings.method = "auto";
      job.notes.candidates = {"path", "path:brute-force"};
    }
    if (world_.random.chance(0.2)) {
      job.spec.goal.adaptive = true;
      if (job.notes.candidates.empty()) {
        job.notes.candidates = {job.spec.settings.method};
      }
    }
    constexpr double kShares[] = {0, 0.3, 1};
    job.spec.audit_share = workers_.have_liars() ? 1
                           : world_.chaos.audits ? kShares[world_.random.below(std::size(kShares))]
                                                 : 0;
    job.spec.allow_mixed = world_.random.chance(0.25);
    if (world_.chaos.poison && world_.random.chance(0.1)) {
      if (!job.notes.candidates.empty() && world_.random.chance(0.3)) {
        job.poisoned_pilot = true;
      } else {
        job.poison = world_.random.below(20);
      }
    }
    job.broken = world_.chaos.refusals && world_.random.chance(0.07);
    jobs_.push_back(std::move(job));
    // A liar alone cannot be found. So if there is one, jobs come when all workers are connected.
    const Duration first = workers_.have_liars() ? Duration(std::chrono::milliseconds(1500)) : Duration{0};
    world_.at(world_.now + first + world_.random.seconds_between(0, i == 0 ? 1 : 5), [this, i] { submit(i); });
  }
}

void ClientSide::request(std::function<bool(Effects&)> ask, Action answered, JobId with_film_of) {
  ++open_requests_;
  auto done = std::make_shared<bool>(false);
  auto attempt = std::make_shared<std::function<void()>>();
  *attempt = [this, ask = std::move(ask), answered = std::move(answered), with_film_of, done,
              weak = std::weak_ptr<std::function<void()>>(attempt)] {
    if (*done) {
      return;
    }
    if (server_.coordinator()) {
      Effects effects;
      const bool waits =
          with_film_of != JobId{} && !server_.coordinator()->use_film(with_film_of, world_.now, effects).value_or(true);
      const bool settled = !waits && ask(effects);
      if (waits) {
        server_.when_film_is_told(with_film_of, [again = weak.lock()] { (*again)(); });
      }
      std::vector<Action> replies;
      if (settled) {
        replies.push_back([this, done, answered] {
          if (!std::exchange(*done, true)) {
            --open_requests_;
            answered();
          }
        });
      }
      server_.execute(std::move(effects), std::move(replies));
    }
    // Not answered in time: repeat the request.
    world_.after(world_.random.seconds_between(0.6, 2), [again = weak.lock()] { (*again)(); });
  };
  (*attempt)();
}

void ClientSide::submit(std::size_t index) {
  auto id = std::make_shared<JobId>();
  request(
      [this, index, id](Effects& effects) {
        JobSpec spec = jobs_[index].spec;
        spec.goal.seconds *= world_.bugs.end_early ? 0.5 : world_.bugs.end_late ? 2 : 1;
        spec.audit_share *= world_.bugs.audit_less ? 0.5 : 1;
        const Result<JobId> made =
            server_.coordinator()->submit(spec, world_.now, world_.unix_ms(), effects, jobs_[index].notes);
        if (!made.ok()) {
          world_.fail(fmt::format("submit: {}", message_of(made.status())));
          return false;
        }
        *id = *made;
        return true;
      },
      [this, index, id] { jobs_[index].id = *id; });
}

void ClientSide::change_something() {
  const std::size_t index = world_.random.below(jobs_.size());
  const ClientJob& job = jobs_[index];
  if (!job.id || job.cancelled) {
    return;
  }
  const double kind = world_.random.uniform();
  if (kind < 0.1 && workers_.have_liars()) {
    if (server_.coordinator()) {
      server_.call([&](Effects& effects) {
        (void)server_.coordinator()->release_worker(workers_[world_.random.below(workers_.size())].name, world_.now,
                                                    effects);
      });
    }
  } else if (kind < 0.4) {
    extend(index);
  } else if (kind < 0.7) {
    pause(index);
  } else if (kind < 0.8) {
    cancel(index);
  } else if (kind < 0.9) {
    const auto priority = static_cast<std::int32_t>(world_.random.below(4));
    request(
        [this, id = *job.id, priority](Effects& effects) {
          return is_settled(server_.coordinator()->set_priority(id, priority, world_.now, effects));
        },
        [] {});
  } else if (kind < 0.95) {
    quarantine(workers_[world_.random.below(workers_.size())].name);
  } else if (server_.coordinator()) {
    server_.call([&](Effects& effects) {
      (void)server_.coordinator()->drain_worker(workers_[world_.random.below(workers_.size())].name, world_.now,
                                                effects);
    });
  }
}

/// By an operator, for a while.
void ClientSide::quarantine(const std::string& worker) {
  const bool render_again = world_.random.chance(0.5);
  request(
      [this, worker, render_again](Effects& effects) {
        return is_settled(server_.coordinator()->quarantine_worker(worker, std::string(kByHand) + "hand", render_again,
                                                                   world_.now, effects));
      },
      [this, worker] {
        world_.inject("workers put into quarantine by hand");
        world_.after(world_.random.seconds_between(0.1, 4), [this, worker] {
          request(
              [this, worker](Effects& effects) {
                return is_settled(server_.coordinator()->release_worker(worker, world_.now, effects));
              },
              [] {});
        });
      });
}

void ClientSide::extend(std::size_t index) {
  if (jobs_[index].error > 0 && jobs_[index].goal > 0) {
    return;  // the sample limit still counts only if it is not reached by then
  }
  const std::uint64_t more = jobs_[index].goal + 1 + world_.random.below(80);
  const Extension to =
      jobs_[index].error > 0 ? Extension{0, jobs_[index].error * world_.random.between(0.5, 1)} : Extension{more};
  request(
      [this, index, to](Effects& effects) {
        const Status status = server_.coordinator()->extend(*jobs_[index].id, to, world_.now, effects);
        // Refused: the job has these samples by an earlier attempt, another extension or time, or it was cancelled.
        return status.ok() || status.code() == StatusCode::kInvalidArgument ||
               status.code() == StatusCode::kFailedPrecondition || status.code() == StatusCode::kNotFound;
      },
      [this, index, to] {
        ClientJob& job = jobs_[index];
        job.goal = std::max(job.goal, to.samples);
        job.error = job.error > 0 ? std::min(job.error, to.error) : 0;
      },
      *jobs_[index].id);
}

void ClientSide::look_at_films() {
  for (const ClientJob& job : jobs_) {
    look_at_film(job);
  }
}

void ClientSide::look_at_film(const ClientJob& job) {
  if (!job.id) {
    return;
  }
  request(
      [this, id = *job.id](Effects&) {
        const bool there = server_.coordinator()->outline(id) != nullptr;
        if (there && server_.coordinator()->film(id) == nullptr) {
          world_.fail(fmt::format("the film of job {} is reported to be in memory, but is not", id.value));
        }
        return true;
      },
      [] {}, *job.id);
}

void ClientSide::pause(std::size_t index) {
  const JobId id = *jobs_[index].id;
  request([this, id](Effects& effects) { return is_settled(server_.coordinator()->pause(id, world_.now, effects)); },
          [this, id] {
            world_.after(world_.random.seconds_between(0.1, 4), [this, id] {
              request(
                  [this, id](Effects& effects) {
                    return is_settled(server_.coordinator()->resume(id, world_.now, effects));
                  },
                  [] {});
            });
          });
}

void ClientSide::cancel(std::size_t index) {
  const JobId id = *jobs_[index].id;
  const bool remove = world_.random.chance(0.5);
  request(
      [this, id](Effects& effects) {
        return is_settled(server_.coordinator()->cancel(id, world_.now, world_.unix_ms(), effects));
      },
      [this, index, id, remove] {
        ClientJob& job = jobs_[index];
        job.cancel_asked = true;
        job.cancelled = is_cancelled_on_disk(id);
        if (job.cancelled && remove) {
          request(
              [this, id](Effects& effects) {
                const Status status = server_.coordinator()->remove(id, world_.now, effects);
                return status.ok() || status.code() == StatusCode::kNotFound;
              },
              [this, index] { jobs_[index].removed = true; });
        }
      });
}

bool ClientSide::is_cancelled_on_disk(JobId id) const {
  const JobRecord* const stored = server_.disk().job(id);
  return stored == nullptr || stored->state == JobState::cancelled;
}

bool ClientSide::all_ended() const {
  if (!server_.coordinator() || open_requests_ > 0) {
    return false;
  }
  for (const ClientJob& job : jobs_) {
    if (!job.id) {
      return false;
    }
    const Result<JobStatus> status = server_.coordinator()->status(*job.id, world_.now);
    if (status.ok() && status->state != JobState::done && status->state != JobState::cancelled &&
        status->state != JobState::failed) {
      return false;
    }
  }
  return true;
}

std::string ClientSide::describe_farm() const {
  std::string text;
  for (const ClientJob& job : jobs_) {
    const Result<JobStatus> status =
        server_.coordinator() && job.id ? server_.coordinator()->status(*job.id, world_.now) : not_found("-");
    text += status.ok()
                ? fmt::format("\n  job {}: {}, tiles have {} to {} of {} samples, {} not audited: {}", job.id->value,
                              lightmill::name_of(status->state), status->min_tile_samples, status->max_tile_samples,
                              status->spec.goal.samples, status->results_unaudited, status->reason)
                : "\n  a missing job";
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

const ClientJob& ClientSide::job_of(const RenderSettings& settings) const {
  return *std::ranges::find_if(jobs_, [&](const ClientJob& job) { return job.spec.settings.scene == settings.scene; });
}

void ClientSide::make_race_job(const Race& race) {
  ClientJob job;
  job.spec.request_id = "race";
  job.spec.settings.scene = "race";
  job.spec.settings.width = 4096;
  job.spec.settings.height = 128;
  job.spec.settings.crop = {0, 63, 4096, 2};  // 128 tiles of 64 pixels
  job.spec.settings.renderer_version = kRendererVersion;
  job.goal = job.spec.goal.samples = race.samples;
  job.spec.audit_share = race.audit_share;
  jobs_.push_back(std::move(job));
}

void ClientSide::note_cancelled() {
  for (ClientJob& job : jobs_) {
    if (job.cancel_asked) {
      job.cancelled = is_cancelled_on_disk(*job.id);
    }
  }
}

}  // namespace lightmill::simulation

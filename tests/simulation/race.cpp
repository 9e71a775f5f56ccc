// One job on workers that are not equally fast.
#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {

FarmSimulation::FarmSimulation(std::uint64_t seed, const Race& race)
    : random_(seed), chaos_(Chaos::none()), race_(race), chaos_end_(now_) {
  chaos_.copies = true;
  make_race();
}

void FarmSimulation::make_race() {
  const PixelRect crop{0, 63, 4096, 2};  // 128 tiles of 64 pixels
  seconds_per_pixel_sample_ = race_->tile_seconds / 64;
  ClientJob job;
  job.spec.request_id = "race";
  job.spec.settings.scene = "race";
  job.spec.settings.width = 4096;
  job.spec.settings.height = 128;
  job.spec.settings.crop = crop;
  job.spec.settings.renderer_version = kRendererVersion;
  job.goal = job.spec.goal.samples = race_->samples;
  job.spec.verify_share = race_->verify_share;
  client_jobs_.push_back(std::move(job));
  at(now_, [this] { start_server(); });
  for (std::size_t i = 0; i < race_->slowness.size(); ++i) {
    SimulatedWorker worker;
    worker.name = worker.machine = fmt::format("worker-{}", i);
    worker.fingerprint = kUsualClass;
    worker.threads = race_->threads;
    worker.slowness = race_->slowness[i];
    workers_.push_back(std::move(worker));
    at(now_ + random_.seconds_between(0, 0.1), [this, i] { start_worker(i); });
  }
  const Time submission = now_ + std::chrono::seconds(1);
  at(submission, [this] {
    race_started_ = now_;
    submit(0);
  });
  at(submission + from_seconds(race_->change_after), [this] {
    SimulatedWorker& last = workers_.back();
    last.slowness = race_->slowness_then > 0 ? race_->slowness_then : last.slowness;
    last.hung_until = race_->hangs_then ? Time::max() : last.hung_until;
  });
}

void FarmSimulation::note_race() {
  if (!race_ || !client_jobs_[0].id || report_.job_seconds > 0) {
    return;
  }
  const JobId job = *client_jobs_[0].id;
  const Film& film = *coordinator_->film(job);
  const std::uint64_t all = film.grid().pixel_count() * race_->samples;
  if (!race_nearly_done_ && film.pixel_samples() * 20 >= all * 19) {
    race_nearly_done_ = now_;
  }
  if (film.pixel_samples() == all && coordinator_->status(job, now_)->state == JobState::done) {
    report_.job_seconds = to_seconds(now_ - *race_started_);
    report_.last_part_seconds = to_seconds(now_ - *race_nearly_done_);
  }
}

}  // namespace lightmill::simulation

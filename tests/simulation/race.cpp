// Race: one job on workers of different speed.
#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {

FarmSimulation::FarmSimulation(std::uint64_t seed, const Race& race, const PlantedBugs& bugs)
    : world_(seed, Chaos::none(), bugs) {
  world_.chaos.copies = true;
  world_.race = race;
  if (race.deceit) {  // only audits compare results
    server_.limits().copy_after = std::chrono::hours(1);
    server_.set_secret(sha256(fmt::format("farm {}", seed)));
  }
  clients_.make_race_job(race);
  world_.at(world_.now, [this] { server_.start(); });
  workers_.make_racers(race);
  const Time submission = world_.now + std::chrono::seconds(1);
  world_.at(submission, [this] {
    race_started_ = world_.now;
    clients_.submit(0);
  });
  world_.at(submission + from_seconds(race.change_after), [this, race] { workers_.change_last(race); });
}

void FarmSimulation::note_race() {
  if (!world_.race || !clients_.jobs()[0].id || world_.report.job_seconds > 0) {
    return;
  }
  const JobId job = *clients_.jobs()[0].id;
  const FilmOutline& film = *server_.coordinator()->outline(job);
  const std::uint64_t all = film.grid().pixel_count() * world_.race->samples;
  if (!race_nearly_done_ && film.pixel_samples() * 20 >= all * 19) {
    race_nearly_done_ = world_.now;
  }
  if (film.pixel_samples() == all && server_.coordinator()->status(job, world_.now)->state == JobState::done) {
    world_.report.job_seconds = to_seconds(world_.now - *race_started_);
    world_.report.last_part_seconds = to_seconds(world_.now - *race_nearly_done_);
  }
}

bool FarmSimulation::deceit_has_ended() const {
  return world_.race && world_.race->deceit && (world_.report.quarantined > 0 || world_.report.job_seconds > 0);
}

}  // namespace lightmill::simulation

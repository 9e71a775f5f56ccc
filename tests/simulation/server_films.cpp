// Films of ended jobs: read from the disk, and reported to waiting clients.
#include "tests/simulation/server_side.h"

namespace lightmill::simulation {

void ServerSide::tell_films(const Effects& effects) {
  for (const FilmOutcome& outcome : effects.films) {
    const auto [begin, end] = film_waits_.equal_range(outcome.job);
    const std::multimap<JobId, Action> waiting(begin, end);
    film_waits_.erase(outcome.job);
    for (const auto& [job, action] : waiting) {
      action();
    }
  }
}

/// Reads tile by tile. Commits may come between.
void ServerSide::read_film(const std::shared_ptr<FilmRead>& read) {
  world_.after(world_.random.seconds_between(0.0005, 0.03), [this, read, life = life_] {
    if (life != life_ || !coordinator_) {
      return;
    }
    const FilmOutline* const film = coordinator_->outline(read->job);
    if (film != nullptr && read->next.value < film->grid().tile_count()) {
      read_tile(*read);
      read_film(read);
      return;
    }
    world_.inject("films read from the disk");
    call([&](Effects& effects) { coordinator_->film_read(read->job, std::move(read->nodes), world_.now, effects); });
  });
}

void ServerSide::read_tile(FilmRead& read) {
  std::vector<NodeKey> damaged;
  std::ranges::move(disk_.read_tile(read.job, read.next, world_.bugs.hide_damage, damaged),
                    std::back_inserter(read.nodes));
  ++read.next.value;
  for (const NodeKey& key : damaged) {
    damaged_.insert({key.job, key.tile});
  }
}

const Film& ServerSide::film_now(JobId job) {
  Effects effects;
  if (!*coordinator_->use_film(job, world_.now, effects)) {
    FilmRead read{job, {}, {}};
    while (read.next.value < coordinator_->outline(job)->grid().tile_count()) {
      read_tile(read);
    }
    coordinator_->film_read(job, std::move(read.nodes), world_.now, effects);
  }
  return *coordinator_->film(job);
}

}  // namespace lightmill::simulation

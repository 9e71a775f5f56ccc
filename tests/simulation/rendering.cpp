// Rendering of simulated workers: preparations, pilots, inspections, tiles, lies.
#include <algorithm>

#include "server/domain/pending_audits.h"
#include "tests/simulation/client_side.h"
#include "tests/simulation/fake_renderer.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {

std::uint64_t pixel_samples(const JobDescription& job, const NodeKey& key) {
  return static_cast<std::uint64_t>(grid_of(job.settings).tile_rect(key.tile).pixel_count()) * key.range.count();
}

double parts_of(const FilmOutline& film, std::uint64_t goal, const NodeKey& key) {
  const std::uint64_t samples = std::min(goal, 2 * std::max(film.frame_samples(), key.range.end()));
  const double result = static_cast<double>(key.range.count()) * film.grid().tile_rect(key.tile).pixel_count();
  return std::max(1.0, kPartsOfAJob * result / (static_cast<double>(samples * film.grid().pixel_count())));
}

std::size_t pilot_choice(const RenderSettings& settings, std::size_t candidates) {
  return (settings.seed + static_cast<std::uint64_t>(settings.crop.width)) % candidates;
}

Allocation pilot_allocation(const RenderSettings& settings) {
  const TileGrid grid = grid_of(settings);
  std::vector<TileNoise> noise;
  for (std::uint32_t tile = 0; tile < grid.picture_tiles(); ++tile) {
    noise.push_back({static_cast<double>(grid.tile_rect(TileId{tile}).pixel_count()),
                     std::ldexp(1.0, static_cast<int>(2 * ((settings.seed + 3 * tile) % 5))), 1});
  }
  const Allocation allocation = allocate(noise, 0).allocation;
  if (allocation.even()) {
    return allocation;
  }
  std::vector<std::int8_t> shifts(allocation.shifts().begin(), allocation.shifts().end());
  shifts.resize(grid.tile_count(), 0);
  return Allocation::of(std::move(shifts)).value();
}

void WorkerSide::prepare(std::size_t index, const PrepareJob& job) {
  const std::uint64_t life = workers_[index].life;
  const JobId id = job.description->job;
  world_.after(world_.random.seconds_between(0.001, 0.2), [this, index, life, id, description = job.description] {
    const bool unavailable = world_.chaos.breaks && world_.random.chance(0.1);
    on_worker(index, life, [=, this](Session& session, SessionActions& actions) {
      if (const std::optional<JobRefusal> refused = refuses(index, description->settings)) {
        session.job_failed(id, *refused, world_.now, actions);
      } else if (unavailable) {
        session.job_unavailable(id, world_.now, actions);
      } else {
        session.job_ready(id, world_.now, actions);
      }
    });
  });
}

void WorkerSide::die_of_poison(std::size_t index) {
  world_.trace("{} is poisoned", workers_[index].name);
  kill(index);
  if (world_.random.chance(0.3)) {
    workers_[index].name += "'";
  }
  world_.after(world_.random.seconds_between(0.05, 3), [this, index] { start(index); });
}

void WorkerSide::run_pilot(std::size_t index, const RunPilot& pilot) {
  const std::uint64_t life = workers_[index].life;
  world_.after(world_.random.seconds_between(0.01, 1), [this, index, life, grant = pilot.grant] {
    if (workers_[index].alive && workers_[index].life == life &&
        (clients_.job_of(grant->settings).poisoned_pilot ||
         (workers_[index].lies == Lies::loses && world_.chaos_now()))) {
      die_of_poison(index);
      return;
    }
    const bool unavailable = world_.chaos.breaks && world_.random.chance(0.1);
    on_worker(index, life, [this, index, grant, unavailable](Session& session, SessionActions& actions) {
      if (const std::optional<JobRefusal> refused = refuses(index, grant->settings)) {
        session.pilot_failed(grant->lease, *refused, world_.now, actions);
        return;
      }
      const std::size_t choice = pilot_choice(grant->settings, grant->methods.size());
      unavailable ? session.pilot_unavailable(grant->lease, world_.now, actions)
                  : session.pilot_done({grant->lease,
                                        static_cast<std::uint32_t>(choice),
                                        {"as it is"},
                                        0.1,
                                        grant->allocate ? pilot_allocation(grant->settings) : Allocation()},
                                       world_.now, actions);
    });
  });
}

/// The session gets the report of its inspection, unless it dropped it.
void WorkerSide::run_inspection(std::size_t index, const RunInspection& inspection) {
  const std::uint64_t life = workers_[index].life, turn = ++workers_[index].inspection;
  const bool deadly = world_.chaos.poison && world_.chaos_now() && world_.random.chance(0.1);
  world_.after(world_.random.seconds_between(0.01, 4), [this, index, life, turn, deadly, grant = inspection.grant] {
    const SimulatedWorker& worker = workers_[index];
    if (!worker.alive || worker.life != life || worker.inspection != turn ||
        (world_.bugs.lose_reports && world_.chaos_now())) {
      return;
    }
    if (deadly) {
      return die_of_poison(index);
    }
    on_worker(index, life, [this, grant](Session& session, SessionActions& actions) {
      Inspection found;
      found.scene = grant->request->scene.at(0);
      session.inspection_done({grant->inspection, std::make_shared<const Inspection>(std::move(found))}, actions);
    });
  });
}

bool WorkerSide::joins_deceit(const NodeKey& key) {
  const Deceit& deceit = *world_.race->deceit;
  const FilmOutline& film = *server_.coordinator()->outline(key.job);
  const double parts = parts_of(film, world_.race->samples, key);
  if (film.covered(key.tile, key.range)) {
    return !deceit.know_audits;
  }
  if (parts < deceit.least_parts || parts > deceit.most_parts || deceit_parts_ + parts > deceit.parts ||
      !deceit_.insert(key).second) {
    return false;
  }
  deceit_parts_ += parts;
  return true;
}

void WorkerSide::note_agreement(const std::string& identity, const NodeKey& key) {
  std::set<std::string>& all = identities_[key];
  all.insert(identity);
  if (all.contains(kIdentityOfLies) && all.contains(kSecondIdentityOfLies) && agreed_.insert(key).second) {
    world_.inject("wrong results of two identities that agree");
  }
}

bool WorkerSide::is_outvoted(const std::string& identity) const {
  return std::ranges::any_of(agreed_, [&](const NodeKey& key) { return identities_.at(key).contains(identity); });
}

void WorkerSide::lie(std::size_t index, const NodeKey& key, RenderedTile& rendered) {
  const Lies lies = workers_[index].lies;
  if (lies == Lies::always || (lies == Lies::sometimes && world_.random.chance(0.3)) ||
      (lies == Lies::by_plan && joins_deceit(key) && world_.random.chance(world_.race->deceit->wrong))) {
    // All liars of a machine send the same wrong bits.
    world_.report.lied = true;
    float& value = rendered.node.values[key.range.index % rendered.node.values.size()];
    value = std::nextafter(value, 1e30f);
    rendered.hash = hash_of(rendered.node);
  } else if (lies == Lies::garbage && world_.random.chance(0.7)) {
    switch (world_.random.below(4)) {
      case 0:
        rendered.hash.low ^= 1;
        break;
      case 1:
        rendered.node.values.front() += 1;
        break;
      case 2:
        rendered.node.values.back() = std::numeric_limits<float>::quiet_NaN();
        rendered.hash = hash_of(rendered.node);
        break;
      default:
        rendered.node.values.pop_back();
        rendered.hash = hash_of(rendered.node);
    }
  }
}

void WorkerSide::render(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  while (worker.rendering.size() < worker.threads && !worker.to_render.empty()) {
    const RenderTile tile = worker.to_render.front();
    worker.to_render.pop_front();
    worker.rendering.emplace(tile.ticket, tile.key);
    const std::uint64_t samples = pixel_samples(*tile.description, tile.key);
    double seconds =
        static_cast<double>(samples) * seconds_per_pixel_sample_ * worker.slowness * world_.random.between(0.7, 1.3);
    if (world_.now < worker.slow_until) {
      seconds = std::min(100 * seconds, seconds + to_seconds(worker.slow_until - world_.now));
    }
    const std::uint64_t life = worker.life;
    world_.after(from_seconds(seconds),
                 [this, index, life, tile, seconds] { tile_rendered(index, life, tile, seconds); });
  }
}

void WorkerSide::tile_rendered(std::size_t index, std::uint64_t life, const RenderTile& tile, double seconds) {
  SimulatedWorker& worker = workers_[index];
  if (!worker.alive || worker.life != life || !worker.rendering.contains(tile.ticket)) {
    return;
  }
  if (tile.key.tile == TileId{0} && tile.key.range.end() > clients_.job_of(tile.description->settings).poison) {
    die_of_poison(index);
    return;
  }
  if (worker.lies == Lies::loses && world_.chaos_now()) {
    world_.inject("leases lost on purpose");
    die_of_poison(index);
    return;
  }
  if (worker.lies == Lies::idle) {
    world_.inject("tiles that are never delivered");
    return;
  }
  worker.rendering.erase(tile.ticket);
  if (memory_ends(index, 0.002)) {
    worker.unacknowledged.erase(tile.key);
    render(index);
    on_worker(index, life, [this, ticket = tile.ticket](Session& session, SessionActions& actions) {
      session.tile_rendered({ticket, {}, {}, 0, "out of memory"}, world_.now, actions);
    });
    return;
  }
  world_.report.rendered += pixel_samples(*tile.description, tile.key);
  const RenderSettings& settings = tile.description->settings;
  const auto pixels = static_cast<std::size_t>(grid_of(settings).tile_rect(tile.key.tile).pixel_count());
  RenderedTile rendered;
  rendered.ticket = tile.ticket;
  rendered.node = *shared_renderer().node(
      tile.description->render_digest, tile.key.tile, tile.key.range, pixels, NodeLayout(settings.layers),
      clients_.job_of(settings).spec.allow_mixed && worker.fingerprint != kUsualClass);
  if (world_.bugs.wrong_bits && index == 0) {
    rendered.node.values[0] = std::nextafter(rendered.node.values[0], 1e30f);
  }
  rendered.hash = hash_of(rendered.node);
  lie(index, tile.key, rendered);
  if (world_.chaos.attack == Attack::two_identities || world_.chaos.attack == Attack::second_identity) {
    note_agreement(worker.identity, tile.key);
  }
  rendered.seconds = seconds;
  render(index);
  on_worker(index, life, [this, rendered](Session& session, SessionActions& actions) {
    session.tile_rendered(rendered, world_.now, actions);
  });
}

/// The thread of the tile notices after a while, unless it is done sooner.
void WorkerSide::stop_tile(std::size_t index, std::uint64_t ticket) {
  const std::uint64_t life = workers_[index].life;
  world_.after(world_.random.seconds_between(0.0001, 0.05), [this, index, life, ticket] {
    SimulatedWorker& worker = workers_[index];
    if (!worker.alive || worker.life != life) {
      return;
    }
    const auto waiting = std::ranges::find(worker.to_render, ticket, &RenderTile::ticket);
    const auto under_way = worker.rendering.find(ticket);
    if (waiting != worker.to_render.end()) {
      worker.unacknowledged.erase(waiting->key);
      worker.to_render.erase(waiting);
    } else if (under_way != worker.rendering.end()) {
      worker.unacknowledged.erase(under_way->second);
      worker.rendering.erase(under_way);
    } else {
      return;
    }
    render(index);
    on_worker(index, life, [this, ticket](Session& session, SessionActions& actions) {
      session.tile_rendered({.ticket = ticket, .node = {}, .hash = {}, .seconds = 0}, world_.now, actions);
    });
  });
}

}  // namespace lightmill::simulation

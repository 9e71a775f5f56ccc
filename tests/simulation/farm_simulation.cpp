#include "tests/simulation/farm_simulation.h"

#include "tests/simulation/end_checks.h"
#include "tests/simulation/fake_renderer.h"

namespace lightmill::simulation {
namespace {

constexpr std::uint64_t kMaxEvents = 3'000'000;
constexpr Duration kTimeout = std::chrono::seconds(3000);  ///< after chaos, until all jobs must be done
constexpr Duration kSettling = std::chrono::seconds(15);

}  // namespace

FarmSimulation::FarmSimulation(std::uint64_t seed, const Chaos& chaos, const PlantedBugs& bugs)
    : world_(seed, chaos, bugs) {
  shared_renderer().trim();
  CoordinatorLimits& limits = server_.limits();
  limits.heartbeat_interval = std::chrono::milliseconds(500);
  limits.lease_duration = std::chrono::seconds(3);
  limits.disconnect_grace = std::chrono::milliseconds(1500);
  limits.restart_grace = std::chrono::milliseconds(2500);
  limits.unit_seconds = 0.3;
  limits.tile_cpu_seconds = bugs.wait_for_the_idle ? 1e6 : 60;
  limits.auditor_timeout = std::chrono::seconds(20);
  limits.copy_after = limits.copy_pilot_after =
      chaos.copies ? Duration(std::chrono::milliseconds(300)) : Duration(std::chrono::hours(1));
  if (bugs.blame_hastily) {
    limits.losses_before_alone = 0;
    limits.losses_alone = 1;
  }
  limits.losses_alone -= bugs.blame_early ? 1 : 0;
  limits.lease_duration = bugs.expire_early ? limits.heartbeat_interval * 3 / 4 : limits.lease_duration;
  limits.refusals = bugs.believe_one_refusal ? 1 : limits.refusals;
  constexpr double kIdleSeconds[] = {0, 0.05, 1, 600};
  limits.film_idle = from_seconds(chaos.films ? kIdleSeconds[world_.random.below(4)] : 600);
  limits.film_bytes_per_job = world_.random.chance(0.3) ? 1 : 1 << 20;  // the minimum, or plenty
  make_schedule();
}

void FarmSimulation::make_schedule() {
  world_.chaos_end = world_.now + world_.random.seconds_between(3, 12);
  workers_.make();
  clients_.make_jobs();
  clients_.make_inspections();
  world_.at(world_.now, [this] { server_.start(); });
  const Chaos& chaos = world_.chaos;
  const auto some_times = [&](bool wanted, std::uint64_t limit, const auto& fault) {
    for (std::uint64_t n = world_.random.below(limit); wanted && n > 0; --n) {
      world_.at(world_.some_time(), fault);
    }
  };
  some_times(chaos.deaths, 6, [this] { workers_.kill_one(); });
  some_times(chaos.hangs, 4, [this] { workers_.hang_one(); });
  some_times(chaos.breaks, 8, [this] { workers_.break_one(); });
  for (std::uint64_t n = world_.random.below(4); chaos.restarts && n > 0; --n) {
    if (world_.random.chance(0.5)) {
      world_.at(world_.some_time(), [this] { server_.crash(world_.random.chance(0.5)); });
    } else {
      server_.crash_at_commit(1 + world_.random.below(60));
    }
  }
  some_times(chaos.changes, 6, [this] { clients_.change_something(); });
  make_faults();
}

void FarmSimulation::make_faults() {
  const Chaos& chaos = world_.chaos;
  const auto some_times = [&](bool wanted, std::uint64_t limit, const auto& fault) {
    for (std::uint64_t n = wanted ? world_.random.below(limit) : 0; n > 0; --n) {
      world_.at(world_.some_time(), fault);
    }
  };
  if (chaos.cuts && world_.random.chance(0.5)) {
    server_.limits().silence = std::chrono::seconds(6);
  }
  some_times(chaos.cuts, 4, [this] { workers_.cut_link(); });
  some_times(chaos.slow, 3, [this] { workers_.slow_down(); });
  some_times(chaos.disks, 3, [this] { server_.fill_disk(); });
  some_times(chaos.deposes, 2, [this] { server_.depose(); });
  some_times(chaos.films, 6, [this] { clients_.look_at_film(); });
  workers_.plan_babble();
}

Report FarmSimulation::run() {
  std::optional<Time> settled_since;
  while (world_.report.failure.empty()) {
    if (++world_.report.events > kMaxEvents) {
      world_.fail("too many events");
      break;
    }
    if (!world_.run_next()) {
      world_.fail("no event is left");
      break;
    }
    note_race();
    if (deceit_has_ended()) {
      break;
    }
    if (world_.now > world_.chaos_end + kTimeout) {
      world_.fail(fmt::format("jobs are not done long after the last fault:{}", clients_.describe_farm()));
    }
    if (world_.chaos_now() || !clients_.all_ended()) {
      settled_since.reset();
    } else if (!settled_since) {
      settled_since = world_.now;
    } else if (world_.now > *settled_since + kSettling && !std::exchange(films_seen_, true)) {
      clients_.look_at_films();  // damaged nodes of them are rendered again
      settled_since.reset();
    } else if (world_.now > *settled_since + kSettling) {
      checks_.check_acknowledged_is_durable();
      clients_.note_cancelled();
      EndChecks(world_, server_, workers_, clients_).check();
      break;
    }
  }
  world_.report.effects = server_.effects_hash();
  return world_.report;
}

}  // namespace lightmill::simulation

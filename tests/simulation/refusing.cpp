// Refusals of simulated workers: of broken jobs, of jobs too large for them, and by liars.
#include "tests/simulation/client_side.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {

std::optional<JobRefusal> WorkerSide::refuses(std::size_t index, const RenderSettings& settings) {
  if (clients_.job_of(settings).broken) {
    return JobRefusal{kBroken};
  }
  if (is_too_large(index, settings)) {
    ++world_.report.too_large;
    return JobRefusal{"too large", true};
  }
  const bool is_spiteful = workers_[index].lies != Lies::never && workers_[index].lies != Lies::loses &&
                           world_.chaos.attack != Attack::two_identities;  // two refusals would fail each job
  if (world_.chaos.refusals && is_spiteful && world_.random.chance(0.3)) {
    world_.inject("refusals out of spite");
    return JobRefusal{kSpite, world_.random.chance(0.5)};
  }
  return memory_ends(index, 0.02) ? std::optional(JobRefusal{"out of memory", true}) : std::nullopt;
}

bool WorkerSide::is_too_large(std::size_t index, const RenderSettings& settings) const {
  const bool first_of_class =
      std::none_of(workers_.begin(), workers_.begin() + static_cast<std::ptrdiff_t>(index),
                   [&](const SimulatedWorker& other) { return other.fingerprint == workers_[index].fingerprint; });
  // Not on farms with liars, where all honest workers are needed to find one, or to continue without it.
  const bool liars =
      std::ranges::any_of(workers_, [](const SimulatedWorker& each) { return each.lies != Lies::never; });
  return world_.chaos.small && !liars && !first_of_class && (settings.seed + index) % 3 == 0;
}

bool WorkerSide::memory_ends(std::size_t index, double chance) {
  if (!world_.chaos.memory || !world_.chaos_now() || !world_.random.chance(chance)) {
    return false;
  }
  world_.inject("workers out of memory");
  world_.after(world_.random.seconds_between(0.5, 4), [this, index, life = workers_[index].life] {
    on_worker(index, life, [this](Session& session, SessionActions& actions) { session.drain(world_.now, actions); });
  });
  return true;
}

}  // namespace lightmill::simulation

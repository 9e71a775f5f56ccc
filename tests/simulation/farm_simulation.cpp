#include "tests/simulation/farm_simulation.h"

#include <algorithm>

namespace lightmill::simulation {
namespace {

constexpr std::uint64_t kMostEvents = 3'000'000;
constexpr Duration kPatience = std::chrono::seconds(3000);  ///< after chaos, until everything must be done
constexpr Duration kSettling = std::chrono::seconds(15);

}  // namespace

FakeRenderer& shared_renderer() {
  static thread_local FakeRenderer renderer;
  return renderer;
}

FarmSimulation::FarmSimulation(std::uint64_t seed, const Chaos& chaos, const PlantedBugs& bugs)
    : random_(seed), chaos_(chaos), bugs_(bugs) {
  shared_renderer().trim();
  limits_.heartbeat_interval = std::chrono::milliseconds(500);
  limits_.lease_duration = std::chrono::seconds(3);
  limits_.disconnect_grace = std::chrono::milliseconds(1500);
  limits_.restart_grace = std::chrono::milliseconds(2500);
  limits_.unit_seconds = 0.3;
  limits_.auditor_patience = std::chrono::seconds(20);
  limits_.copy_after = limits_.copy_pilot_after =
      chaos.copies ? Duration(std::chrono::milliseconds(300)) : Duration(std::chrono::hours(1));
  if (bugs_.blame_hastily) {
    limits_.losses_before_alone = 0;
    limits_.losses_alone = 1;
  }
  limits_.film_bytes_per_job = random_.chance(0.3) ? 1 : 1 << 20;  // the least, or plenty
  make_schedule();
}

std::int64_t FarmSimulation::unix_ms() const {
  return std::chrono::duration_cast<std::chrono::milliseconds>(now_.time_since_epoch()).count();
}

void FarmSimulation::at(Time time, Action action) {
  events_.push({std::max(time, now_), next_order_++, std::move(action)});
}

void FarmSimulation::fail(std::string what) {
  if (report_.failure.empty()) {
    report_.failure = fmt::format("at {:.3f} s: {}", to_seconds(now_.time_since_epoch()), what);
  }
}

void FarmSimulation::make_workers() {
  std::size_t count = 1 + random_.below(4);
  const double kind = chaos_.liars ? random_.uniform() : 1;
  has_liars_ = kind < 0.3;
  const bool garbage = !has_liars_ && kind < 0.4;
  const std::size_t liars = has_liars_ ? 1 + random_.below(2) : garbage ? 1 : 0;
  if (has_liars_) {
    count = liars + 2 + random_.below(2);
  } else if (garbage) {
    count = std::max<std::size_t>(count, 2);
  }
  for (std::size_t i = 0; i < count; ++i) {
    SimulatedWorker worker;
    worker.name = fmt::format("worker-{}", i);
    worker.machine = i < liars ? "machine-of-lies" : fmt::format("machine-{}", i);
    worker.lies = i >= liars            ? Lies::never
                  : garbage             ? Lies::garbage
                  : random_.chance(0.5) ? Lies::always
                                        : Lies::sometimes;
    worker.fingerprint = liars == 0 && random_.chance(0.15) ? "class-b" : kUsualClass;
    worker.threads = 1 + static_cast<std::uint32_t>(random_.below(3));
    worker.slowness = random_.chance(0.2) ? random_.between(2, 6) : random_.between(0.7, 1.5);
    workers_.push_back(std::move(worker));
    at(now_ + random_.seconds_between(0, 1), [this, i] { start_worker(i); });
  }
}

void FarmSimulation::make_schedule() {
  chaos_end_ = now_ + random_.seconds_between(3, 12);
  const auto some_time = [&] { return now_ + from_seconds(random_.uniform() * to_seconds(chaos_end_ - now_)); };

  make_workers();
  make_jobs();
  make_inspections();
  at(now_, [this] { start_server(); });

  for (std::uint64_t n = random_.below(6); chaos_.deaths && n > 0; --n) {
    at(some_time(), [this] {
      const std::size_t index = random_.below(workers_.size());
      kill_worker(index);
      const bool other_name = random_.chance(0.5);
      after(random_.seconds_between(0.05, 6), [this, index, other_name] {
        if (other_name && !workers_[index].alive) {
          workers_[index].name += "'";
        }
        start_worker(index);
      });
    });
  }
  for (std::uint64_t n = random_.below(4); chaos_.hangs && n > 0; --n) {
    at(some_time(), [this] {
      inject("workers that hang");
      workers_[random_.below(workers_.size())].hung_until = now_ + random_.seconds_between(0.1, 8);
    });
  }
  for (std::uint64_t n = random_.below(8); chaos_.breaks && n > 0; --n) {
    at(some_time(), [this] {
      if (const auto stream = workers_[random_.below(workers_.size())].stream) {
        break_stream(stream);
      }
    });
  }
  for (std::uint64_t n = random_.below(4); chaos_.restarts && n > 0; --n) {
    if (random_.chance(0.5)) {
      at(some_time(), [this] { crash_server(random_.chance(0.5)); });
    } else {
      crash_at_commit_.insert(1 + random_.below(60));
    }
  }
  for (std::uint64_t n = random_.below(6); chaos_.changes && n > 0; --n) {
    at(some_time(), [this] { change_something(); });
  }
  make_faults();
}

Report FarmSimulation::run() {
  std::optional<Time> settled_since;
  while (report_.failure.empty()) {
    if (events_.empty()) {
      fail("nothing will ever happen again");
      break;
    }
    if (++report_.events > kMostEvents) {
      fail("too many events");
      break;
    }
    Event event = events_.top();
    events_.pop();
    now_ = event.time;
    event.action();
    note_race();
    if (now_ > chaos_end_ + kPatience) {
      fail(fmt::format("jobs are not done long after the last disturbance:{}", describe_farm()));
    }
    if (chaos_now() || !all_ended()) {
      settled_since.reset();
    } else if (!settled_since) {
      settled_since = now_;
    } else if (now_ > *settled_since + kSettling) {
      check_end();
      break;
    }
  }
  if (effects_) {
    report_.effects = effects_->finish();
  }
  return report_;
}

}  // namespace lightmill::simulation

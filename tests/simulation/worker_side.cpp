#include "tests/simulation/worker_side.h"

#include <algorithm>

#include "common/base/overloaded.h"
#include "tests/simulation/client_side.h"
#include "tests/simulation/server_side.h"

namespace lightmill::simulation {

void WorkerSide::make() {
  std::size_t count = 1 + world_.random.below(4);
  const double kind = world_.chaos.liars ? world_.random.uniform() : 1;
  const std::optional<Attack> attack = world_.chaos.attack;
  const bool garbage = attack ? attack == Attack::garbage : kind >= 0.3 && kind < 0.4;
  const bool idle = attack ? attack == Attack::idle : world_.chaos.idle && kind >= 0.4 && kind < 0.48;
  have_liars_ = attack ? !garbage && !idle : kind < 0.3;
  std::size_t liars = have_liars_ ? 1 + world_.random.below(2) : garbage || idle ? 1 : 0;
  const bool two_identities = attack == Attack::two_identities;
  liars = attack ? 1 + (attack == Attack::two_names || two_identities ? 1 : 0) : liars;
  if (have_liars_) {
    count = liars + 2 + world_.random.below(2);
  } else if (garbage || idle) {
    count = std::max<std::size_t>(count, 2);
  }
  have_certificates_ = world_.random.chance(0.5) || attack == Attack::claims || attack == Attack::two_names ||
                       attack == Attack::second_identity || two_identities;
  const bool own_class = two_identities && world_.random.chance(0.3);
  for (std::size_t i = 0; i < count; ++i) {
    SimulatedWorker worker;
    worker.name = fmt::format("worker-{}", i);
    worker.identity = i >= liars                ? fmt::format("identity-{}", i)
                      : two_identities && i > 0 ? kSecondIdentityOfLies
                                                : kIdentityOfLies;
    worker.machine = worker.identity;
    worker.lies = i >= liars                            ? Lies::never
                  : garbage                             ? Lies::garbage
                  : idle                                ? Lies::idle
                  : attack == Attack::some_wrong_sums   ? Lies::sometimes
                  : attack == Attack::ungranted         ? Lies::in_requests
                  : attack == Attack::spite             ? Lies::in_requests
                  : attack == Attack::losses            ? Lies::loses
                  : attack || world_.random.chance(0.5) ? Lies::always
                                                        : Lies::sometimes;
    const bool other_class = liars == 0 ? world_.random.chance(0.15) : own_class && i < liars;
    worker.fingerprint = other_class ? "class-b" : kUsualClass;
    worker.threads = 1 + static_cast<std::uint32_t>(world_.random.below(3));
    worker.slowness = world_.random.chance(0.2) ? world_.random.between(2, 6) : world_.random.between(0.7, 1.5);
    workers_.push_back(std::move(worker));
    world_.at(world_.now + world_.random.seconds_between(0, 1), [this, i] { start(i); });
  }
  if (attack == Attack::second_identity) {
    come_again_when_found(0);
  }
}

void WorkerSide::make_racers(const Race& race) {
  seconds_per_pixel_sample_ = race.tile_seconds / 64;
  for (std::size_t i = 0; i < race.slowness.size(); ++i) {
    SimulatedWorker worker;
    worker.name = worker.identity = worker.machine = fmt::format("worker-{}", i);
    worker.fingerprint = kUsualClass;
    worker.threads = race.threads;
    worker.slowness = race.slowness[i];
    if (race.deceit && i < race.deceit->liars) {
      worker.identity = worker.machine = kIdentityOfLies;
      worker.lies = Lies::by_plan;
      have_liars_ = have_certificates_ = true;
    }
    workers_.push_back(std::move(worker));
    world_.at(world_.now + world_.random.seconds_between(0, 0.1), [this, i] { start(i); });
    if (race.deceit && race.deceit->new_names && i < race.deceit->liars) {
      leave_sometimes(i);
    }
  }
}

void WorkerSide::change_last(const Race& race) {
  SimulatedWorker& last = workers_.back();
  last.slowness = race.slowness_then > 0 ? race.slowness_then : last.slowness;
  last.hung_until = last.disturbed = race.hangs_then ? Time::max() : last.hung_until;
}

void WorkerSide::start(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  if (worker.alive) {
    return;
  }
  ++worker.life;
  worker.alive = true;
  change_claims(worker);
  worker.hung_until = world_.now;
  worker.rendering.clear();
  worker.to_render.clear();
  worker.unacknowledged.clear();
  worker.next_tick = Time::max();
  SessionConfig config;
  config.name = worker.name;
  config.host = worker.machine;
  config.machine = worker.machine;
  config.pid = static_cast<std::uint32_t>(worker.life);
  config.threads = worker.threads;
  config.fingerprint_class = world_.bugs.hide_classes ? kUsualClass : worker.fingerprint;
  config.renderer_version = kRendererVersion;
  config.unacknowledged_bytes = world_.race ? 1 << 20 : 20'000;
  worker.session = std::make_unique<Session>(config);
  on_worker(index, worker.life,
            [this](Session& session, SessionActions& actions) { session.start(world_.now, actions); });
}

void WorkerSide::kill(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  if (!worker.alive) {
    return;
  }
  ++world_.report.deaths;
  world_.trace("{} dies", worker.name);
  for (const auto& [key, samples] : worker.unacknowledged) {
    world_.report.lost_with_workers += samples;
  }
  ++worker.life;
  worker.alive = false;
  worker.session.reset();
  if (worker.stream) {
    break_stream(worker.stream);
    worker.stream.reset();
  }
}

void WorkerSide::on_worker(std::size_t index, std::uint64_t life, std::function<void(Session&, SessionActions&)> call) {
  SimulatedWorker& worker = workers_[index];
  if (!worker.alive || worker.life != life) {
    return;
  }
  if (world_.now < worker.hung_until) {
    world_.at(worker.hung_until, [this, index, life, call = std::move(call)] { on_worker(index, life, call); });
    return;
  }
  SessionActions actions;
  call(*worker.session, actions);
  const SessionStatus status = worker.session->status();
  if (status.tiles_rendering > 2 * worker.threads) {
    world_.fail(fmt::format("{} has {} tiles with {} threads", worker.name, status.tiles_rendering, worker.threads));
  }
  act(index, actions);
  plan_tick(index);
}

void WorkerSide::act(std::size_t index, const SessionActions& actions) {
  for (const SessionAction& action : actions) {
    SimulatedWorker& worker = workers_[index];
    if (!worker.alive) {
      return;
    }
    std::visit(Overloaded{
                   [&](const OpenStream&) { open_stream(index); },
                   [&](const CloseStream&) {
                     if (worker.stream && !worker.stream->broken) {
                       const std::shared_ptr<Stream> stream = std::exchange(worker.stream, nullptr);
                       world_.at(std::max(stream->last_up, world_.now) + std::chrono::microseconds(10),
                                 [this, stream] { break_stream(stream); });
                     }
                   },
                   [&](const SendMessage& send) { sends(index, send.message); },
                   [&](const PrepareJob& job) { prepare(index, job); },
                   [](const ForgetJob&) {},
                   [&](const RunPilot& pilot) { run_pilot(index, pilot); },
                   [&](const RunInspection& inspection) { run_inspection(index, inspection); },
                   [&](const DropInspection&) { ++worker.inspection; },
                   [](const ResultStored&) {},
                   [](const LogNotice&) {},
                   [](const DropPilot&) {},  // a late answer must do no harm
                   [&](const RenderTile& tile) {
                     worker.last_tile = tile;
                     worker.to_render.push_back(tile);
                     worker.unacknowledged[tile.key] = pixel_samples(*tile.description, tile.key);
                     render(index);
                   },
                   [&](const StopTile& stop) { stop_tile(index, stop.ticket); },
                   [&](const Exit& exit) {
                     if (!exit.failed && !worker.unacknowledged.empty() && !world_.chaos.repeats &&
                         !world_.chaos.hangs && !world_.chaos.breaks) {
                       world_.fail(fmt::format("{} leaves with results that are not acknowledged", worker.name));
                     }
                     kill(index);
                     world_.after(world_.random.seconds_between(0.1, 5), [this, index] { start(index); });
                   },
               },
               action);
  }
}

void WorkerSide::acknowledged(std::size_t index, const ResultAck& ack) {
  for (const NodeKey& key : ack.keys) {
    workers_[index].unacknowledged.erase(key);
  }
}

void WorkerSide::open_stream(std::size_t index) {
  const std::uint64_t life = workers_[index].life;
  world_.after(world_.random.seconds_between(0.001, 0.1), [this, index, life] {
    SimulatedWorker& worker = workers_[index];
    if (!worker.alive || worker.life != life) {
      return;
    }
    if (!server_.coordinator()) {
      on_worker(index, life,
                [this](Session& session, SessionActions& actions) { session.disconnected(world_.now, actions); });
      return;
    }
    auto stream = std::make_shared<Stream>();
    stream->worker = index;
    stream->name = worker.name;
    stream->worker_life = life;
    server_.open_stream(stream);
    worker.stream = stream;
    on_worker(index, life, [this, stream](Session& session, SessionActions& actions) {
      if (workers_[stream->worker].stream == stream) {
        session.connected(world_.now, actions);
      }
    });
  });
}

void WorkerSide::break_stream(const std::shared_ptr<Stream>& stream) {
  if (stream->broken) {
    return;
  }
  stream->broken = true;
  stream->lingers = world_.chaos.breaks && world_.random.chance(0.3);
  world_.trace("stream {} of {} breaks", stream->session.value, workers_[stream->worker].name);
  // Each end notices by itself, sometimes only after a missed keepalive.
  const auto delay = [&] {
    const bool late = world_.chaos.breaks && world_.random.chance(0.2);
    return late ? world_.random.seconds_between(1, 6) : world_.random.seconds_between(0, 0.05);
  };
  world_.after(delay(), [this, stream] {
    if (workers_[stream->worker].stream != stream) {
      return;
    }
    on_worker(stream->worker, stream->worker_life, [this, stream](Session& session, SessionActions& actions) {
      if (workers_[stream->worker].stream == stream) {
        workers_[stream->worker].stream.reset();
        session.disconnected(world_.now, actions);
      }
    });
  });
  world_.after(delay(), [this, stream] {
    stream->lingers = false;
    const std::shared_ptr<Stream> newest = workers_[stream->worker].stream;
    const SessionId session = world_.bugs.disconnect_newest && newest ? newest->session : stream->session;
    server_.disconnected(*stream, session);
  });
}

void WorkerSide::sends(std::size_t index, const std::shared_ptr<const WorkerMessage>& message) {
  const std::shared_ptr<Stream> stream = workers_[index].stream;
  if (std::holds_alternative<WorkerResult>(*message)) {
    workers_[index].last_result = message;
  }
  if (!stream || stream->broken || (world_.bugs.lose_what_is_cut && world_.now < stream->cut_up)) {
    return;
  }
  const int times = world_.chaos.repeats && world_.random.chance(0.05) ? 2 : 1;
  for (int i = 0; i < times; ++i) {
    const Duration delay = !world_.race && world_.random.chance(0.02) ? world_.random.seconds_between(0.1, 1)
                                                                      : world_.random.seconds_between(0.0002, 0.005);
    stream->last_up = std::max({stream->last_up, world_.now + delay, stream->cut_up});
    world_.at(stream->last_up, [this, stream, message] { server_.receive(stream, *message); });
  }
}

void WorkerSide::plan_tick(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  if (!worker.alive) {
    return;
  }
  const std::optional<Time> next = worker.session->next_deadline();
  if (!next || *next >= worker.next_tick) {
    return;
  }
  worker.next_tick = std::max(*next, world_.now);
  world_.at(worker.next_tick, [this, index, life = worker.life, time = worker.next_tick] {
    if (workers_[index].life == life && workers_[index].next_tick == time) {
      workers_[index].next_tick = Time::max();
      on_worker(index, life, [this](Session& session, SessionActions& actions) { session.tick(world_.now, actions); });
    }
  });
}

}  // namespace lightmill::simulation

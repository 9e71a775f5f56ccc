// Workers in their simulated processes: streams, threads, deaths and hangs.
#include <algorithm>

#include "common/base/overloaded.h"
#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {
namespace {

std::uint64_t pixel_samples(const JobDescription& job, const NodeKey& key) {
  return static_cast<std::uint64_t>(grid_of(job.settings).tile_rect(key.tile).pixel_count()) * key.range.count();
}

}  // namespace

void FarmSimulation::start_worker(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  if (worker.alive) {
    return;
  }
  ++worker.life;
  worker.alive = true;
  worker.hung_until = now_;
  worker.rendering.clear();
  worker.to_render.clear();
  worker.unacknowledged.clear();
  worker.next_tick = Time::max();
  SessionConfig config;
  config.name = worker.name;
  config.host = "host";
  config.machine = worker.machine;
  config.pid = static_cast<std::uint32_t>(worker.life);
  config.threads = worker.threads;
  config.fingerprint_class = bugs_.hide_classes ? kUsualClass : worker.fingerprint;
  config.renderer_version = kRendererVersion;
  config.unacknowledged_bytes = race_ ? 1 << 20 : 20'000;
  worker.session = std::make_unique<Session>(config);
  on_worker(index, worker.life, [this](Session& session, SessionActions& actions) { session.start(now_, actions); });
}

void FarmSimulation::kill_worker(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  if (!worker.alive) {
    return;
  }
  ++report_.deaths;
  trace("{} dies", worker.name);
  for (const auto& [key, samples] : worker.unacknowledged) {
    report_.lost_with_workers += samples;
  }
  ++worker.life;
  worker.alive = false;
  worker.session.reset();
  if (worker.stream) {
    break_stream(worker.stream);
    worker.stream.reset();
  }
}

void FarmSimulation::on_worker(std::size_t index, std::uint64_t life,
                               std::function<void(Session&, SessionActions&)> call) {
  SimulatedWorker& worker = workers_[index];
  if (!worker.alive || worker.life != life) {
    return;
  }
  if (now_ < worker.hung_until) {
    at(worker.hung_until, [this, index, life, call = std::move(call)] { on_worker(index, life, call); });
    return;
  }
  SessionActions actions;
  call(*worker.session, actions);
  const SessionStatus status = worker.session->status();
  if (status.tiles_rendering > 2 * worker.threads) {
    fail(fmt::format("{} has {} tiles with {} threads", worker.name, status.tiles_rendering, worker.threads));
  }
  act(index, actions);
  plan_worker_tick(index);
}

void FarmSimulation::act(std::size_t index, const SessionActions& actions) {
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
                       at(std::max(stream->last_up, now_) + std::chrono::microseconds(10),
                          [this, stream] { break_stream(stream); });
                     }
                   },
                   [&](const SendMessage& send) { worker_sends(index, send.message); },
                   [&](const PrepareJob& job) { prepare(index, job); },
                   [](const ForgetJob&) {},
                   [&](const RunPilot& pilot) { run_pilot(index, pilot); },
                   [&](const RunInspection& inspection) { run_inspection(index, inspection); },
                   [&](const DropInspection&) { ++worker.inspection; },
                   [](const ResultStored&) {},
                   [](const Say&) {},
                   [](const DropPilot&) {},  // an answer that comes nevertheless must do no harm
                   [&](const RenderTile& tile) {
                     worker.to_render.push_back(tile);
                     worker.unacknowledged[tile.key] = pixel_samples(*tile.description, tile.key);
                     render(index);
                   },
                   [&](const StopTile& stop) { stop_tile(index, stop.ticket); },
                   [&](const Exit& exit) {
                     if (!exit.failed && !worker.unacknowledged.empty() && !chaos_.repeats && !chaos_.hangs &&
                         !chaos_.breaks) {
                       fail(fmt::format("{} leaves with results that are not acknowledged", worker.name));
                     }
                     kill_worker(index);
                     after(random_.seconds_between(0.1, 5), [this, index] { start_worker(index); });
                   },
               },
               action);
  }
}

void FarmSimulation::open_stream(std::size_t index) {
  const std::uint64_t life = workers_[index].life;
  after(random_.seconds_between(0.001, 0.1), [this, index, life] {
    SimulatedWorker& worker = workers_[index];
    if (!worker.alive || worker.life != life) {
      return;
    }
    if (!coordinator_) {
      on_worker(index, life,
                [this](Session& session, SessionActions& actions) { session.disconnected(now_, actions); });
      return;
    }
    auto stream = std::make_shared<Stream>();
    stream->worker = index;
    stream->name = worker.name;
    stream->worker_life = life;
    stream->server_life = server_life_;
    stream->session = SessionId{next_session_++};
    streams_[stream->session] = stream;
    worker.stream = stream;
    on_worker(index, life, [this, stream](Session& session, SessionActions& actions) {
      if (workers_[stream->worker].stream == stream) {
        session.connected(now_, actions);
      }
    });
  });
}

void FarmSimulation::break_stream(const std::shared_ptr<Stream>& stream) {
  if (stream->broken) {
    return;
  }
  stream->broken = true;
  stream->lingers = chaos_.breaks && random_.chance(0.3);
  trace("stream {} of {} breaks", stream->session.value, workers_[stream->worker].name);
  // Each end notices on its own, sometimes only when a keepalive is missed.
  const auto delay = [&] {
    const bool late = chaos_.breaks && random_.chance(0.2);
    return late ? random_.seconds_between(1, 6) : random_.seconds_between(0, 0.05);
  };
  after(delay(), [this, stream] {
    if (workers_[stream->worker].stream != stream) {
      return;
    }
    on_worker(stream->worker, stream->worker_life, [this, stream](Session& session, SessionActions& actions) {
      if (workers_[stream->worker].stream == stream) {
        workers_[stream->worker].stream.reset();
        session.disconnected(now_, actions);
      }
    });
  });
  after(delay(), [this, stream] {
    stream->lingers = false;
    if (stream->server_life == server_life_ && coordinator_) {
      const std::shared_ptr<Stream> newest = workers_[stream->worker].stream;
      const SessionId session = bugs_.disconnect_newcomers && newest ? newest->session : stream->session;
      on_server([&](Effects& effects) { coordinator_->worker_disconnected(session, now_, effects); });
      streams_.erase(stream->session);
    }
  });
}

void FarmSimulation::worker_sends(std::size_t index, const std::shared_ptr<const WorkerMessage>& message) {
  const std::shared_ptr<Stream> stream = workers_[index].stream;
  if (!stream || stream->broken || (bugs_.lose_what_is_cut && now_ < stream->cut_up)) {
    return;
  }
  const int times = chaos_.repeats && random_.chance(0.05) ? 2 : 1;
  for (int i = 0; i < times; ++i) {
    const Duration delay =
        !race_ && random_.chance(0.02) ? random_.seconds_between(0.1, 1) : random_.seconds_between(0.0002, 0.005);
    stream->last_up = std::max({stream->last_up, now_ + delay, stream->cut_up});
    at(stream->last_up, [this, stream, message] { server_receives(stream, *message); });
  }
}

void FarmSimulation::prepare(std::size_t index, const PrepareJob& job) {
  const std::uint64_t life = workers_[index].life;
  const JobId id = job.description->job;
  const bool too_large = is_too_large(index, job.description->settings);
  after(random_.seconds_between(0.001, 0.2), [this, index, life, id, too_large] {
    const bool unavailable = chaos_.breaks && random_.chance(0.1);
    on_worker(index, life, [this, id, unavailable, too_large](Session& session, SessionActions& actions) {
      report_.too_large += too_large;
      too_large     ? session.job_failed(id, {"too large", true}, now_, actions)
      : unavailable ? session.job_unavailable(id, now_, actions)
                    : session.job_ready(id, now_, actions);
    });
  });
}

std::size_t pilot_choice(const RenderSettings& settings, std::size_t candidates) {
  return (settings.seed + static_cast<std::uint64_t>(settings.crop.width)) % candidates;
}

Allocation pilot_allocation(const RenderSettings& settings) {
  std::vector<std::int8_t> shifts;
  for (std::uint32_t tile = 0; tile < grid_of(settings).tile_count(); ++tile) {
    shifts.push_back(static_cast<std::int8_t>((settings.seed + 3 * tile) % 5) - 2);
  }
  return Allocation::of(std::move(shifts)).value();
}

const FarmSimulation::ClientJob& FarmSimulation::job_of(const RenderSettings& settings) const {
  return *std::ranges::find_if(client_jobs_,
                               [&](const ClientJob& job) { return job.spec.settings.scene == settings.scene; });
}

bool FarmSimulation::is_too_large(std::size_t index, const RenderSettings& settings) const {
  const bool first_of_class =
      std::none_of(workers_.begin(), workers_.begin() + static_cast<std::ptrdiff_t>(index),
                   [&](const SimulatedWorker& other) { return other.fingerprint == workers_[index].fingerprint; });
  // Not where it takes all honest ones to find a liar, or to go on without it.
  const bool liars =
      std::ranges::any_of(workers_, [](const SimulatedWorker& each) { return each.lies != Lies::never; });
  return chaos_.small && !liars && !first_of_class && (settings.seed + index) % 3 == 0;
}

void FarmSimulation::die_of_poison(std::size_t index) {
  trace("{} is poisoned", workers_[index].name);
  kill_worker(index);
  if (random_.chance(0.3)) {
    workers_[index].name += "'";
  }
  after(random_.seconds_between(0.05, 3), [this, index] { start_worker(index); });
}

void FarmSimulation::run_pilot(std::size_t index, const RunPilot& pilot) {
  const std::uint64_t life = workers_[index].life;
  after(random_.seconds_between(0.01, 1), [this, index, life, grant = pilot.grant] {
    if (workers_[index].alive && workers_[index].life == life && job_of(grant->settings).poisoned_pilot) {
      die_of_poison(index);
      return;
    }
    const bool unavailable = chaos_.breaks && random_.chance(0.1);
    on_worker(index, life, [this, index, grant, unavailable](Session& session, SessionActions& actions) {
      if (is_too_large(index, grant->settings)) {
        ++report_.too_large;
        session.pilot_failed(grant->lease, {"too large", true}, now_, actions);
        return;
      }
      const std::size_t choice = pilot_choice(grant->settings, grant->methods.size());
      unavailable ? session.pilot_unavailable(grant->lease, now_, actions)
                  : session.pilot_done({grant->lease,
                                        static_cast<std::uint32_t>(choice),
                                        {"as it is"},
                                        0.1,
                                        grant->allocate ? pilot_allocation(grant->settings) : Allocation()},
                                       now_, actions);
    });
  });
}

void FarmSimulation::lie(std::size_t index, const NodeKey& key, RenderedTile& rendered) {
  const Lies lies = workers_[index].lies;
  if (lies == Lies::always || (lies == Lies::sometimes && random_.chance(0.3))) {
    // All liars of a machine lie alike.
    report_.lied = true;
    float& value = rendered.node.values[key.range.index % rendered.node.values.size()];
    value = std::nextafter(value, 1e30f);
    rendered.hash = hash_of(rendered.node);
  } else if (lies == Lies::garbage && random_.chance(0.7)) {
    switch (random_.below(4)) {
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

void FarmSimulation::render(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  while (worker.rendering.size() < worker.threads && !worker.to_render.empty()) {
    const RenderTile tile = worker.to_render.front();
    worker.to_render.pop_front();
    worker.rendering.emplace(tile.ticket, tile.key);
    const std::uint64_t samples = pixel_samples(*tile.description, tile.key);
    double seconds =
        static_cast<double>(samples) * seconds_per_pixel_sample_ * worker.slowness * random_.between(0.7, 1.3);
    if (now_ < worker.slow_until) {
      seconds = std::min(100 * seconds, seconds + to_seconds(worker.slow_until - now_));
    }
    const std::uint64_t life = worker.life;
    after(from_seconds(seconds), [this, index, life, tile, seconds, samples] {
      SimulatedWorker& again = workers_[index];
      if (!again.alive || again.life != life || !again.rendering.contains(tile.ticket)) {
        return;
      }
      if (tile.key.tile == TileId{0} && tile.key.range.end() > job_of(tile.description->settings).poison) {
        die_of_poison(index);
        return;
      }
      again.rendering.erase(tile.ticket);
      report_.rendered += samples;
      const RenderSettings& settings = tile.description->settings;
      const auto pixels = static_cast<std::size_t>(grid_of(settings).tile_rect(tile.key.tile).pixel_count());
      RenderedTile rendered;
      rendered.ticket = tile.ticket;
      rendered.node = *shared_renderer().node(tile.description->render_digest, tile.key.tile, tile.key.range, pixels,
                                              NodeLayout(settings.layers),
                                              job_of(settings).spec.allow_mixed && again.fingerprint != kUsualClass);
      if (bugs_.wrong_bits && index == 0) {
        rendered.node.values[0] = std::nextafter(rendered.node.values[0], 1e30f);
      }
      rendered.hash = hash_of(rendered.node);
      lie(index, tile.key, rendered);
      rendered.seconds = seconds;
      render(index);
      on_worker(index, life, [this, rendered](Session& session, SessionActions& actions) {
        session.tile_rendered(rendered, now_, actions);
      });
    });
  }
}

/// Its thread notices after a while, if it is not done before that.
void FarmSimulation::stop_tile(std::size_t index, std::uint64_t ticket) {
  const std::uint64_t life = workers_[index].life;
  after(random_.seconds_between(0.0001, 0.05), [this, index, life, ticket] {
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
      session.tile_rendered({.ticket = ticket, .node = {}, .hash = {}, .seconds = 0}, now_, actions);
    });
  });
}

void FarmSimulation::plan_worker_tick(std::size_t index) {
  SimulatedWorker& worker = workers_[index];
  if (!worker.alive) {
    return;
  }
  const std::optional<Time> next = worker.session->next_deadline();
  if (!next || *next >= worker.next_tick) {
    return;
  }
  worker.next_tick = std::max(*next, now_);
  at(worker.next_tick, [this, index, life = worker.life, time = worker.next_tick] {
    if (workers_[index].life == life && workers_[index].next_tick == time) {
      workers_[index].next_tick = Time::max();
      on_worker(index, life, [this](Session& session, SessionActions& actions) { session.tick(now_, actions); });
    }
  });
}

}  // namespace lightmill::simulation

// What else befalls a farm: links that are cut one way, slow workers, garbage, bad disks, a coordinator that is
// deposed.
#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {

void FarmSimulation::inject(const std::string& kind) {
  ++report_.faults[kind];
  trace("injected: {}", kind);
}

void FarmSimulation::make_faults() {
  const auto some_time = [&] { return now_ + from_seconds(random_.uniform() * to_seconds(chaos_end_ - now_)); };
  const auto some_times = [&](bool wanted, std::uint64_t limit, void (FarmSimulation::*fault)()) {
    for (std::uint64_t n = wanted ? random_.below(limit) : 0; n > 0; --n) {
      at(some_time(), [this, fault] { (this->*fault)(); });
    }
  };
  if (chaos_.cuts && random_.chance(0.5)) {
    limits_.silence = std::chrono::seconds(6);
  }
  some_times(chaos_.cuts, 4, &FarmSimulation::cut_link);
  some_times(chaos_.slow, 3, &FarmSimulation::slow_down);
  some_times(chaos_.disks, 3, &FarmSimulation::fill_disk);
  some_times(chaos_.deposes, 2, &FarmSimulation::depose_server);
  for (std::size_t i = 0; i < workers_.size(); ++i) {
    for (std::uint64_t n = workers_[i].lies == Lies::garbage ? random_.below(12) : 0; n > 0; --n) {
      at(some_time(), [this, i] { babble(i); });
    }
  }
}

void FarmSimulation::cut_link() {
  const std::shared_ptr<Stream> stream = workers_[random_.below(workers_.size())].stream;
  if (!stream || stream->broken) {
    return;
  }
  inject("links cut one way");
  const Time until = now_ + random_.seconds_between(0.3, 10);
  (random_.chance(0.5) ? stream->cut_up : stream->cut_down) = until;
  if (random_.chance(0.5)) {  // one end misses its keepalives before it heals
    at(now_ + from_seconds(random_.uniform() * to_seconds(until - now_)), [this, stream] { break_stream(stream); });
  }
}

void FarmSimulation::slow_down() {
  inject("workers a hundred times slower");
  workers_[random_.below(workers_.size())].slow_until = now_ + random_.seconds_between(0.5, 10);
}

/// Something that makes no sense, from a worker that is otherwise as it should be.
void FarmSimulation::babble(std::size_t index) {
  const SimulatedWorker& worker = workers_[index];
  if (!worker.alive || now_ < worker.hung_until || !worker.stream || !worker.session->status().connected ||
      client_jobs_.empty()) {
    return;
  }
  inject("messages of garbage");
  // Numbers that are some lease's, or nobody's.
  const LeaseId lease{(epoch_ - random_.below(2)) << 32 | random_.below(200)};
  const JobId job{1 + random_.below(client_jobs_.size() + 1)};
  const auto send = [&](WorkerMessage message) {
    worker_sends(index, std::make_shared<const WorkerMessage>(std::move(message)));
  };
  switch (random_.below(4)) {
    case 0:
      send(WorkerHeartbeat{{lease, LeaseId{random_.next()}}});
      break;
    case 1:
      send(WorkerReturn{lease});
      break;
    case 2:
      send(PilotReport{lease, 99, {}, 0.1, Allocation()});
      break;
    default: {
      const SampleRange range{static_cast<std::uint32_t>(random_.below(40)),
                              static_cast<std::uint32_t>(random_.next())};
      WorkerResult result;
      result.lease = lease;
      result.key = {job, TileId{static_cast<std::uint32_t>(random_.below(1000))}, range};
      result.node = {range, {1.0f, 2.0f}, 0};
      result.hash = hash_of(result.node);
      result.seconds = 1e300;
      send(std::move(result));
    }
  }
}

void FarmSimulation::fill_disk() {
  const Time until = now_ + random_.seconds_between(0.3, 6);
  if (random_.chance(0.5)) {
    inject("slow disks");
    disk_slow_until_ = until;
    return;
  }
  inject("full disks");
  disk_full_until_ = std::max(disk_full_until_, until);
  after(random_.seconds_between(0, 0.3), [this] {
    if (now_ < disk_full_until_) {
      on_server([&](Effects& effects) { coordinator_->hold("the disk is full", now_, effects); });
    }
  });
  at(until + std::chrono::milliseconds(100), [this] {
    if (now_ >= disk_full_until_) {
      on_server([&](Effects& effects) { coordinator_->hold("", now_, effects); });
    }
  });
}

void FarmSimulation::damage_disk() {
  if (!chaos_.damage || !chaos_now() || !random_.chance(0.3)) {
    return;
  }
  if (const std::vector<NodeKey> nodes = disk_.nodes_in_use(); !nodes.empty()) {
    inject("damaged nodes");
    disk_.damage(nodes[random_.below(nodes.size())]);
  }
}

void FarmSimulation::depose_server() {
  if (!coordinator_ || deposed_) {
    return;
  }
  inject("coordinators deposed");
  lose_inspections();
  deposed_.emplace(Deposed{std::move(coordinator_), server_life_, epoch_, std::exchange(streams_, {}), {}, {}});
  ++server_life_;
  abandon_commits(random_.chance(0.5));
  for (Pending& each : std::exchange(pending_, {})) {
    deposed_->unwritten.insert(deposed_->unwritten.end(), each.writes.begin(), each.writes.end());
  }
  const Duration takeover = random_.seconds_between(0.05, 3);
  after(takeover, [this] { start_server(); });
  after(takeover + random_.seconds_between(0.01, 4), [this] { resume_deposed(); });
  for (const auto& [session, stream] : deposed_->streams) {
    after(random_.seconds_between(0, 5), [this, stream] { break_stream(stream); });
  }
}

void FarmSimulation::resume_deposed() {
  const Deposed deposed = std::move(*std::exchange(deposed_, std::nullopt));
  trace("the deposed coordinator goes on");
  std::vector<StoreOp> writes = deposed.unwritten;
  const auto take = [&](const auto& call) {
    Effects effects;
    call(effects);
    note_effects(effects, *deposed.coordinator);
    writes.insert(writes.end(), effects.writes.begin(), effects.writes.end());
    for (const Outgoing& message : effects.now) {
      if (const auto to = deposed.streams.find(message.to); to != deposed.streams.end()) {
        deliver(to->second, message.message);
      }
    }
  };
  for (const auto& [stream, message] : deposed.inbox) {
    take([&](Effects& effects) {
      const auto* hello = std::get_if<WorkerHello>(&message);
      if (hello != nullptr && !std::exchange(stream->said_hello, true)) {
        deposed.coordinator->worker_connected(stream->session, *hello, now_, effects);
      } else {
        deposed.coordinator->worker_message(stream->session, message, now_, unix_ms(), effects);
      }
    });
  }
  take([&](Effects& effects) { deposed.coordinator->tick(now_, unix_ms(), effects); });
  // Its commit is refused, and it ends.
  if (const auto wrong = disk_.apply(bugs_.no_epochs ? disk_.epoch() : deposed.epoch, writes)) {
    fail(*wrong);
  }
  for (const auto& [session, stream] : deposed.streams) {
    break_stream(stream);
  }
}

}  // namespace lightmill::simulation

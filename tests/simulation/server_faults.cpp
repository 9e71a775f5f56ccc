// Faults of the coordinator and its disk: a full or slow disk, damage, and takeover by another coordinator.
#include "tests/simulation/checks.h"
#include "tests/simulation/client_side.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {

void ServerSide::fill_disk() {
  const Time until = world_.now + world_.random.seconds_between(0.3, 6);
  if (world_.random.chance(0.5)) {
    world_.inject("slow disks");
    disk_slow_until_ = until;
    return;
  }
  world_.inject("full disks");
  disk_full_until_ = std::max(disk_full_until_, until);
  world_.after(world_.random.seconds_between(0, 0.3), [this] {
    if (world_.now < disk_full_until_) {
      call([&](Effects& effects) { coordinator_->hold("the disk is full", world_.now, effects); });
    }
  });
  world_.at(until + std::chrono::milliseconds(100), [this] {
    if (world_.now >= disk_full_until_) {
      call([&](Effects& effects) { coordinator_->hold("", world_.now, effects); });
    }
  });
}

void ServerSide::damage_disk() {
  if (!world_.chaos.damage || !world_.chaos_now() || !world_.random.chance(0.3)) {
    return;
  }
  if (const std::vector<NodeKey> nodes = disk_.nodes_in_use(); !nodes.empty()) {
    world_.inject("damaged nodes");
    disk_.damage(nodes[world_.random.below(nodes.size())]);
  }
}

void ServerSide::depose() {
  if (!coordinator_ || deposed_) {
    return;
  }
  world_.inject("coordinators deposed");
  checks_.check_shown_ends();
  clients_.lose_inspections();
  deposed_.emplace(Deposed{std::move(coordinator_), life_, epoch_, std::exchange(streams_, {}), {}, {}});
  ++life_;
  film_waits_.clear();
  abandon_commits(world_.random.chance(0.5));
  for (Pending& each : std::exchange(pending_, {})) {
    deposed_->unwritten.insert(deposed_->unwritten.end(), each.writes.begin(), each.writes.end());
  }
  const Duration takeover = world_.random.seconds_between(0.05, 3);
  world_.after(takeover, [this] { start(); });
  world_.after(takeover + world_.random.seconds_between(0.01, 4), [this] { resume_deposed(); });
  for (const auto& [session, stream] : deposed_->streams) {
    world_.after(world_.random.seconds_between(0, 5), [this, stream] { workers_.break_stream(stream); });
  }
}

void ServerSide::resume_deposed() {
  const Deposed deposed = std::move(*std::exchange(deposed_, std::nullopt));
  world_.trace("the deposed coordinator resumes");
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
        deposed.coordinator->worker_connected(stream->session, *hello, world_.now, effects);
      } else {
        deposed.coordinator->worker_message(stream->session, message, world_.now, world_.unix_ms(), effects);
      }
    });
  }
  take([&](Effects& effects) { deposed.coordinator->tick(world_.now, world_.unix_ms(), effects); });
  // The disk ignores its commit, and it ends.
  if (const auto wrong = disk_.apply(world_.bugs.no_epochs ? disk_.epoch() : deposed.epoch, writes)) {
    world_.fail(*wrong);
  }
  for (const auto& [session, stream] : deposed.streams) {
    workers_.break_stream(stream);
  }
}

}  // namespace lightmill::simulation

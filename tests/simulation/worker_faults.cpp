// Faults of workers: deaths, hangs, broken and cut links, slowness, garbage and ungranted results.
#include "tests/simulation/client_side.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {

void WorkerSide::kill_one() {
  const std::size_t index = world_.random.below(workers_.size());
  kill(index);
  const bool other_name = world_.random.chance(0.5);
  world_.after(world_.random.seconds_between(0.05, 6), [this, index, other_name] {
    if (other_name && !workers_[index].alive) {
      workers_[index].name += "'";
    }
    start(index);
  });
}

void WorkerSide::hang_one() {
  world_.inject("workers that hang");
  SimulatedWorker& worker = workers_[world_.random.below(workers_.size())];
  worker.hung_until = world_.now + world_.random.seconds_between(0.1, 8);
  worker.disturbed = std::max(worker.disturbed, worker.hung_until);
}

void WorkerSide::break_one() {
  if (const auto stream = workers_[world_.random.below(workers_.size())].stream) {
    break_stream(stream);
  }
}

void WorkerSide::cut_link() {
  const std::shared_ptr<Stream> stream = workers_[world_.random.below(workers_.size())].stream;
  if (!stream || stream->broken) {
    return;
  }
  world_.inject("links cut one way");
  const Time until = world_.now + world_.random.seconds_between(0.3, 10);
  (world_.random.chance(0.5) ? stream->cut_up : stream->cut_down) = until;
  workers_[stream->worker].disturbed = std::max(workers_[stream->worker].disturbed, until);
  if (world_.random.chance(0.5)) {  // one end misses its keepalives before the link heals
    world_.at(world_.now + from_seconds(world_.random.uniform() * to_seconds(until - world_.now)),
              [this, stream] { break_stream(stream); });
  }
}

void WorkerSide::slow_down() {
  world_.inject("workers a hundred times slower");
  workers_[world_.random.below(workers_.size())].slow_until = world_.now + world_.random.seconds_between(0.5, 10);
}

void WorkerSide::come_again_when_found(std::size_t index) {
  world_.after(std::chrono::milliseconds(200), [this, index] {
    if (world_.report.quarantined == 0) {
      come_again_when_found(index);
      return;
    }
    world_.inject("liars with a second identity");
    kill(index);
    SimulatedWorker& worker = workers_[index];
    worker.identity = worker.machine = kSecondIdentityOfLies;
    worker.name = "worker-again";
    world_.after(world_.random.seconds_between(0.05, 1), [this, index] { start(index); });
  });
}

void WorkerSide::leave_sometimes(std::size_t index) {
  world_.after(world_.random.seconds_between(0.5, 3), [this, index] {
    on_worker(index, workers_[index].life,
              [this](Session& session, SessionActions& actions) { session.drain(world_.now, actions); });
    leave_sometimes(index);
  });
}

void WorkerSide::plan_babble() {
  for (std::size_t i = 0; i < workers_.size(); ++i) {
    if (workers_[i].lies == Lies::never || workers_[i].lies == Lies::idle || workers_[i].lies == Lies::loses) {
      continue;
    }
    for (std::uint64_t n = world_.random.below(12); n > 0; --n) {
      world_.at(world_.some_time(), [this, i] { workers_[i].lies == Lies::garbage ? babble(i) : send_ungranted(i); });
    }
  }
}

/// Sends samples that it was not granted: wrong, but with the right size, digest and hash.
void WorkerSide::send_ungranted(std::size_t index) {
  const SimulatedWorker& worker = workers_[index];
  if (!worker.alive || world_.now < worker.hung_until || !worker.stream || !worker.session->status().connected ||
      !worker.last_tile || !server_.coordinator()) {
    return;
  }
  const NodeKey& asked = worker.last_tile->key;
  const FilmOutline* const film = server_.coordinator()->outline(asked.job);
  if (film == nullptr) {
    return;
  }
  world_.inject("results that were not granted");
  WorkerResult result;
  if (worker.last_result && world_.random.chance(0.7)) {  // with the tag of another grant
    const auto& sent = std::get<WorkerResult>(*worker.last_result);
    result.lease = sent.lease;
    result.tag = sent.tag;
  } else {
    result.lease = worker.last_tile->lease;
    result.tag = sha256(std::to_string(world_.random.next()));
  }
  const auto level = static_cast<std::uint32_t>(world_.random.below(6));
  const TileId tile{static_cast<std::uint32_t>(world_.random.below(film->grid().tile_count()))};
  result.key = {asked.job, tile, {level, static_cast<std::uint32_t>(world_.random.below((64u >> level) + 1))}};
  result.node.range = result.key.range;
  result.node.values.assign(film->expected_values(tile, result.key.range), 1e6f);
  result.hash = hash_of(result.node);
  result.render_digest = worker.last_tile->description->render_digest;
  result.seconds = 1e-6;
  sends(index, std::make_shared<const WorkerMessage>(std::move(result)));
}

void WorkerSide::change_claims(SimulatedWorker& worker) {
  const bool by_plan = worker.lies == Lies::by_plan && world_.race->deceit->new_names;
  if (!have_certificates_ || (worker.lies != Lies::always && worker.lies != Lies::sometimes && !by_plan)) {
    return;
  }
  // Another one's machine, or a new one each time.
  worker.machine = world_.random.chance(0.5) ? workers_[world_.random.below(workers_.size())].identity
                                             : fmt::format("machine {}", world_.random.next());
  worker.name = fmt::format("{}-{}", worker.name.substr(0, worker.name.find('-', 7)), worker.life);
}

/// Sends an invalid message from a worker that otherwise works.
void WorkerSide::babble(std::size_t index) {
  const SimulatedWorker& worker = workers_[index];
  if (!worker.alive || world_.now < worker.hung_until || !worker.stream || !worker.session->status().connected ||
      clients_.jobs().empty()) {
    return;
  }
  world_.inject("messages of garbage");
  // Ids of any lease, or of none.
  const LeaseId lease{(server_.epoch() - world_.random.below(2)) << 32 | world_.random.below(200)};
  const JobId job{1 + world_.random.below(clients_.jobs().size() + 1)};
  const auto send = [&](WorkerMessage message) {
    sends(index, std::make_shared<const WorkerMessage>(std::move(message)));
  };
  switch (world_.random.below(4)) {
    case 0:
      send(WorkerHeartbeat{{lease, LeaseId{world_.random.next()}}, std::chrono::hours(1), {{lease, TileId{0}, 1e9}}});
      break;
    case 1:
      send(WorkerReturn{lease});
      break;
    case 2:
      send(PilotReport{lease, 99, {}, 0.1, Allocation()});
      break;
    default: {
      const SampleRange range{static_cast<std::uint32_t>(world_.random.below(40)),
                              static_cast<std::uint32_t>(world_.random.next())};
      WorkerResult result;
      result.lease = lease;
      result.key = {job, TileId{static_cast<std::uint32_t>(world_.random.below(1000))}, range};
      result.node = {range, {1.0f, 2.0f}, 0};
      result.hash = hash_of(result.node);
      result.seconds = 1e300;
      send(std::move(result));
    }
  }
}

}  // namespace lightmill::simulation

// Inspections of scene files by clients, during all other faults.
#include "tests/simulation/client_side.h"
#include "tests/simulation/server_side.h"

namespace lightmill::simulation {
namespace {

/// Time after chaos in which workers may still be lost by earlier faults.
constexpr Duration kAftermath = std::chrono::seconds(60);

}  // namespace

void ClientSide::make_inspections() {
  if (!world_.chaos.inspections) {
    return;
  }
  for (std::uint64_t n = world_.random.below(6); n > 0; --n) {
    world_.at(world_.some_time(), [this] { ask_inspection(); });
  }
  // After chaos each request is answered: earlier faults keep no worker from inspections.
  ++open_requests_;
  world_.at(world_.chaos_end, [this] { ask_last_inspection(); });
}

std::optional<InspectionId> ClientSide::inspect(const std::string& caller) {
  std::optional<InspectionId> asked;
  server_.call([&](Effects& effects) {
    const std::string scene = fmt::format("scene-{}", ++world_.report.inspections);
    if (const Result<InspectionId> id = server_.coordinator()->inspect(caller, {{}, {scene}, ""}, world_.now, effects);
        id.ok()) {
      asked = *id;
      if (!asked_.emplace(*id, scene).second) {
        world_.fail(fmt::format("two inspections have the number {}", id->value));
      }
    }
  });
  return asked;
}

void ClientSide::ask_inspection() {
  const std::optional<InspectionId> asked = inspect(world_.random.chance(0.7) ? "ann" : "bob");
  if (asked && world_.random.chance(0.2)) {
    world_.after(world_.random.seconds_between(0, 3), [this, id = *asked] {
      if (server_.coordinator() && asked_.erase(id) > 0) {
        server_.coordinator()->forget_inspection(id);
      }
    });
  }
}

void ClientSide::ask_last_inspection() {
  last_inspection_ = inspect("eve");
  if (!last_inspection_) {
    world_.after(std::chrono::seconds(5), [this] { ask_last_inspection(); });
  }
}

/// The clients that asked learn that their coordinator is gone.
void ClientSide::lose_inspections() {
  asked_.clear();
  if (std::exchange(last_inspection_, std::nullopt)) {
    world_.after(std::chrono::seconds(5), [this] { ask_last_inspection(); });
  }
}

void ClientSide::note_inspected(const Effects& effects) {
  for (const InspectionOutcome& outcome : effects.inspected) {
    const auto asked = asked_.find(outcome.id);
    if (asked == asked_.end()) {
      world_.fail(fmt::format("inspection {} is answered, but no client waits for it", outcome.id.value));
      return;
    }
    if (outcome.found.ok() && (*outcome.found)->scene != asked->second) {
      world_.fail(fmt::format("a client that asked for {} got {}", asked->second, (*outcome.found)->scene));
    }
    world_.report.inspected += outcome.found.ok() ? 1 : 0;
    asked_.erase(asked);
    if (last_inspection_ != outcome.id) {
      continue;
    }
    last_inspection_.reset();
    const Status& status = outcome.found.status();
    if (status.ok()) {
      --open_requests_;
    } else if (message_of(status).find("workers were lost") != std::string::npos &&
               world_.now < world_.chaos_end + kAftermath) {
      world_.after(std::chrono::seconds(5), [this] { ask_last_inspection(); });
    } else {
      world_.fail(fmt::format("scene files are not read after the last fault: {}", message_of(status)));
    }
  }
}

}  // namespace lightmill::simulation

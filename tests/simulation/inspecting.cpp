// Clients who have scene files read while everything else befalls the farm.
#include "tests/simulation/farm_simulation.h"

namespace lightmill::simulation {
namespace {

/// So long workers may still be lost by what has befallen them before.
constexpr Duration kAftermath = std::chrono::seconds(60);

}  // namespace

void FarmSimulation::make_inspections() {
  if (!chaos_.inspections) {
    return;
  }
  for (std::uint64_t n = random_.below(6); n > 0; --n) {
    at(now_ + from_seconds(random_.uniform() * to_seconds(chaos_end_ - now_)), [this] { ask_inspection(); });
  }
  // Once nothing disturbs the farm any more, whoever asks is answered: no worker is kept from it by what was before.
  ++open_requests_;
  at(chaos_end_, [this] { ask_last_inspection(); });
}

std::optional<InspectionId> FarmSimulation::inspect(const std::string& caller) {
  std::optional<InspectionId> asked;
  on_server([&](Effects& effects) {
    const std::string scene = fmt::format("scene-{}", ++report_.inspections);
    if (const Result<InspectionId> id = coordinator_->inspect(caller, {{}, {scene}, ""}, now_, effects); id.ok()) {
      asked = *id;
      if (!asked_.emplace(*id, scene).second) {
        fail(fmt::format("two inspections have the number {}", id->value));
      }
    }
  });
  return asked;
}

void FarmSimulation::ask_inspection() {
  const std::optional<InspectionId> asked = inspect(random_.chance(0.7) ? "ann" : "bob");
  if (asked && random_.chance(0.2)) {
    after(random_.seconds_between(0, 3), [this, id = *asked] {
      if (coordinator_ && asked_.erase(id) > 0) {
        coordinator_->forget_inspection(id);
      }
    });
  }
}

void FarmSimulation::ask_last_inspection() {
  last_inspection_ = inspect("eve");
  if (!last_inspection_) {
    after(std::chrono::seconds(5), [this] { ask_last_inspection(); });
  }
}

/// Whoever had asked hears that their coordinator is gone.
void FarmSimulation::lose_inspections() {
  asked_.clear();
  if (std::exchange(last_inspection_, std::nullopt)) {
    after(std::chrono::seconds(5), [this] { ask_last_inspection(); });
  }
}

void FarmSimulation::note_inspected(const Effects& effects) {
  for (const InspectionOutcome& outcome : effects.inspected) {
    const auto asked = asked_.find(outcome.id);
    if (asked == asked_.end()) {
      fail(fmt::format("inspection {} is answered, and nobody waits for it", outcome.id.value));
      return;
    }
    if (outcome.found.ok() && (*outcome.found)->scene != asked->second) {
      fail(fmt::format("who asked for {} is told of {}", asked->second, (*outcome.found)->scene));
    }
    report_.inspected += outcome.found.ok() ? 1 : 0;
    asked_.erase(asked);
    if (last_inspection_ != outcome.id) {
      continue;
    }
    last_inspection_.reset();
    const Status& status = outcome.found.status();
    if (status.ok()) {
      --open_requests_;
    } else if (message_of(status).find("workers were lost") != std::string::npos && now_ < chaos_end_ + kAftermath) {
      after(std::chrono::seconds(5), [this] { ask_last_inspection(); });
    } else {
      fail(fmt::format("scene files are not read when all is quiet: {}", message_of(status)));
    }
  }
}

/// Of which the session has heard the end, or none; one that is dropped is never reported.
void FarmSimulation::run_inspection(std::size_t index, const RunInspection& inspection) {
  const std::uint64_t life = workers_[index].life, turn = ++workers_[index].inspection;
  const bool deadly = chaos_.poison && chaos_now() && random_.chance(0.1);
  after(random_.seconds_between(0.01, 4), [this, index, life, turn, deadly, grant = inspection.grant] {
    const SimulatedWorker& worker = workers_[index];
    if (!worker.alive || worker.life != life || worker.inspection != turn || (bugs_.lose_reports && chaos_now())) {
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

}  // namespace lightmill::simulation

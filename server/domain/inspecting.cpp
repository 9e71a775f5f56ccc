// How scene files come to workers that read them.
#include "server/domain/coordinator_state.h"

namespace lightmill {

void Coordinator::State::serve_inspections(Time now, Step& step) {
  if (!inspections.waiting()) {
    return;
  }
  std::vector<Inspections::Candidate> candidates;
  for (const auto& [name, worker] : workers) {
    if (may_inspect(worker) && !worker.silent) {
      candidates.push_back({name, *worker.session, worker.leases.size()});
    }
  }
  inspections.serve(candidates, now, step);
}

Result<InspectionId> Coordinator::inspect(const std::string& caller, InspectionRequest request, Time now, Step& step) {
  State& state = *state_;
  if (std::ranges::none_of(state.workers, [](const auto& entry) { return State::may_inspect(entry.second); })) {
    return unavailable("no worker is here that could read the scene: start one");
  }
  LM_ASSIGN_OR_RETURN(const InspectionId id, state.inspections.add(caller, std::move(request), now));
  state.serve_inspections(now, step);
  return id;
}

void Coordinator::forget_inspection(InspectionId id) {
  state_->inspections.forget(id);
}

}  // namespace lightmill

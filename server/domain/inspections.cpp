#include "server/domain/inspections.h"

#include <algorithm>

#include "server/domain/notes.h"

namespace lightmill {

Result<InspectionId> Inspections::add(const std::string& caller, InspectionRequest request, Time now) {
  if (waiting_.size() >= limits_.most) {
    return resource_exhausted("{} scenes wait to be read already: try again later", waiting_.size());
  }
  const auto own = std::ranges::count_if(waiting_, [&](const auto& each) { return each.second.caller == caller; });
  if (static_cast<std::size_t>(own) >= limits_.most_per_caller) {
    return resource_exhausted("{} scenes of yours wait to be read already: try again when one is done", own);
  }
  const InspectionId id{next_++};
  waiting_[id] = {caller, std::make_shared<const InspectionRequest>(std::move(request)), now + limits_.patience, {}, 0};
  return id;
}

void Inspections::forget(InspectionId id) {
  waiting_.erase(id);
}

bool Inspections::waiting() const {
  return std::ranges::any_of(waiting_, [](const auto& each) { return !each.second.reader; });
}

void Inspections::serve(std::span<const Candidate> candidates, Time now, Step& step) {
  std::vector<Candidate> free;
  std::ranges::copy_if(candidates, std::back_inserter(free),
                       [&](const Candidate& each) { return !busy_.contains(each.session); });
  std::ranges::stable_sort(free, {}, &Candidate::leases);
  auto next = free.begin();
  for (auto& [id, waiting] : waiting_) {
    if (waiting.reader) {
      continue;
    }
    if (next == free.end()) {
      return;
    }
    waiting.reader = next->session;
    waiting.deadline = now + limits_.reading;
    busy_[next->session] = id;
    step.now.push_back({next->session, InspectGrant{id, waiting.request}});
    note(step, Note::Level::info, about(next->worker), "worker {} reads the scene files of inspection {}", next->worker,
         id.value);
    ++next;
  }
}

void Inspections::report(SessionId session, const InspectReport& report, Step& step) {
  const auto busy = busy_.find(session);
  if (busy == busy_.end() || busy->second != report.inspection) {
    return;  // taken for lost meanwhile
  }
  busy_.erase(busy);
  answer(report.inspection, report.found, step);
}

void Inspections::left(SessionId session, bool lost, Time now, Step& step) {
  const auto busy = busy_.find(session);
  if (busy == busy_.end()) {
    return;
  }
  const InspectionId id = busy->second;
  busy_.erase(busy);
  const auto found = waiting_.find(id);
  if (found == waiting_.end()) {
    return;
  }
  Waiting& waiting = found->second;
  waiting.reader.reset();
  waiting.deadline = now + limits_.patience;
  waiting.lost += lost ? 1 : 0;
  if (waiting.lost >= limits_.losses) {
    note(step, Note::Level::warning, Subject{}, "inspection {} is given up: {} workers were lost with it", id.value,
         waiting.lost);
    answer(id,
           unavailable("{} workers were lost while they read these files; they may be too large, or damaged in a way "
                       "that nothing expects",
                       waiting.lost),
           step);
  }
}

void Inspections::tick(Time now, Step& step) {
  std::vector<InspectionId> late;
  for (const auto& [id, waiting] : waiting_) {
    if (now >= waiting.deadline) {
      late.push_back(id);
    }
  }
  for (const InspectionId id : late) {
    answer(id,
           waiting_.at(id).reader
               ? make_error(StatusCode::kDeadlineExceeded, "a worker has read these files for {:.0f} s without an end",
                            to_seconds(limits_.reading))
               : unavailable("no worker has had time to read these files within {:.0f} s: try again later",
                             to_seconds(limits_.patience)),
           step);
  }
}

std::optional<Time> Inspections::next_deadline() const {
  std::optional<Time> next;
  for (const auto& [id, waiting] : waiting_) {
    next = next ? std::min(*next, waiting.deadline) : waiting.deadline;
  }
  return next;
}

void Inspections::answer(InspectionId id, Result<std::shared_ptr<const Inspection>> found, Step& step) {
  if (waiting_.erase(id) > 0) {
    step.inspected.push_back({id, std::move(found)});
  }
}

}  // namespace lightmill

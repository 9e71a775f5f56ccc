#include "server/domain/inspections.h"

#include <algorithm>

namespace lightmill {

Result<InspectionId> Inspections::add(const std::string& caller, InspectionRequest request, Time now) {
  if (std::ranges::none_of(workers_.all(), [](const auto& entry) { return entry.second.may_inspect(); })) {
    return unavailable("no connected worker can read scene files: start one");
  }
  if (waiting_.size() >= limits_.most) {
    return resource_exhausted("{} scenes wait to be read already: try again later", waiting_.size());
  }
  const auto own = std::ranges::count_if(waiting_, [&](const auto& each) { return each.second.caller == caller; });
  if (static_cast<std::size_t>(own) >= limits_.most_per_caller) {
    return resource_exhausted("{} scenes of yours wait to be read already: try again when one is done", own);
  }
  const InspectionId id{next_++};
  waiting_[id] = {caller, std::make_shared<const InspectionRequest>(std::move(request)), now + limits_.timeout, {}, 0};
  return id;
}

void Inspections::serve(const Event& event) {
  if (std::ranges::all_of(waiting_, [](const auto& each) { return each.second.reader.has_value(); })) {
    return;
  }
  std::vector<const Worker*> free;
  for (const auto& [name, worker] : workers_.all()) {
    if (worker.may_inspect() && !worker.silent() && !busy_.contains(*worker.session())) {
      free.push_back(&worker);
    }
  }
  std::ranges::stable_sort(free, {}, [this](const Worker* worker) {
    const auto missed = missed_.find(worker->identity());
    return std::pair(missed == missed_.end() ? 0 : missed->second, worker->leases().size());
  });
  for (const Worker* const reader : free) {
    const auto found = next(reader->identity());
    if (found == waiting_.end()) {
      continue;
    }
    auto& [id, waiting] = *found;
    waiting.reader = reader->session();
    waiting.deadline = event.now + limits_.reading;
    busy_[*reader->session()] = id;
    last_reader_[waiting.caller] = ++readers_given_;
    event.send(*reader->session(), InspectGrant{id, waiting.request});
    event.info(about(reader->name()), "worker {} reads the scene files of inspection {}", reader->name(), id.value);
  }
}

std::map<InspectionId, Inspections::Waiting>::iterator Inspections::next(const std::string& identity) {
  std::map<std::string_view, std::size_t> readers;
  for (const auto& [id, waiting] : waiting_) {
    readers[waiting.caller] += waiting.reader ? 1 : 0;
  }
  std::erase_if(last_reader_, [&](const auto& entry) { return !readers.contains(entry.first); });
  auto best = waiting_.end();
  std::pair<std::size_t, std::uint64_t> of_best;
  for (auto at = waiting_.begin(); at != waiting_.end(); ++at) {
    const auto last = last_reader_.find(at->second.caller);
    const std::pair of_this(readers.at(at->second.caller), last == last_reader_.end() ? 0 : last->second);
    if (!at->second.reader && !at->second.silent.contains(identity) && (best == waiting_.end() || of_this < of_best)) {
      best = at;
      of_best = of_this;
    }
  }
  return best;
}

void Inspections::report(SessionId session, const InspectReport& report, const Event& event) {
  const auto busy = busy_.find(session);
  if (busy == busy_.end() || busy->second != report.inspection) {
    return;  // it was taken for lost meanwhile
  }
  busy_.erase(busy);
  missed_.erase(workers_.find_session(session)->identity);
  answer(report.inspection, report.found, event);
}

void Inspections::left(SessionId session, bool lost, const Event& event) {
  const auto busy = busy_.find(session);
  if (busy == busy_.end()) {
    return;
  }
  const InspectionId id = busy->second;
  busy_.erase(busy);
  const auto found = waiting_.find(id);
  if (found == waiting_.end() || found->second.reader != session) {
    return;  // answered, forgotten, or passed on
  }
  Waiting& waiting = found->second;
  waiting.reader.reset();
  waiting.deadline = event.now + limits_.timeout;
  waiting.lost += lost ? 1 : 0;
  if (waiting.lost >= limits_.losses) {
    event.warn({}, "inspection {} failed: {} workers were lost with it", id.value, waiting.lost);
    answer(
        id,
        unavailable("{} workers were lost while they read these files. They may be too large or damaged", waiting.lost),
        event);
  }
}

void Inspections::tick(const Event& event) {
  std::vector<InspectionId> late;
  for (const auto& [id, waiting] : waiting_) {
    if (event.now >= waiting.deadline) {
      late.push_back(id);
    }
  }
  for (const InspectionId id : late) {
    if (waiting_.at(id).reader && pass_on(waiting_.at(id), event)) {
      continue;
    }
    answer(id,
           waiting_.at(id).reader
               ? make_error(StatusCode::kDeadlineExceeded,
                            "a worker did not read these files to the end within {:.0f} s", to_seconds(limits_.reading))
               : unavailable("no worker was free to read these files within {:.0f} s: try again later",
                             to_seconds(limits_.timeout)),
           event);
  }
}

bool Inspections::pass_on(Waiting& waiting, const Event& event) {
  const WorkerRegistry::Session* const reader = workers_.find_session(*waiting.reader);
  if (reader == nullptr) {
    return false;
  }
  ++missed_[reader->identity];
  waiting.silent.insert(reader->identity);
  const bool others = std::ranges::any_of(workers_.all(), [&](const auto& entry) {
    return entry.second.may_inspect() && !waiting.silent.contains(entry.second.identity());
  });
  if (++waiting.lost >= limits_.losses || !others) {
    return false;
  }
  waiting.reader.reset();
  waiting.deadline = event.now + limits_.timeout;
  return true;
}

std::optional<Time> Inspections::next_deadline() const {
  std::optional<Time> next;
  for (const auto& [id, waiting] : waiting_) {
    next = next ? std::min(*next, waiting.deadline) : waiting.deadline;
  }
  return next;
}

void Inspections::answer(InspectionId id, Result<std::shared_ptr<const Inspection>> found, const Event& event) {
  if (waiting_.erase(id) > 0) {
    event.effects.inspected.push_back({id, std::move(found)});
  }
}

}  // namespace lightmill

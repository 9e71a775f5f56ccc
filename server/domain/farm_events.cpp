#include "server/domain/farm_events.h"

#include <algorithm>

#include "common/base/text.h"

namespace lightmill {
namespace {

bool is_of_kind(const Note& note, FarmEvents::Kind kind) {
  switch (kind) {
    case FarmEvents::Kind::warnings:
      return note.level == Note::Level::warning;
    case FarmEvents::Kind::jobs:
      return note.job != JobId{};
    case FarmEvents::Kind::workers:
      return !note.worker.empty();
    case FarmEvents::Kind::all:
      break;
  }
  return true;
}

}  // namespace

void FarmEvents::add(std::int64_t unix_ms, Note note, std::string owner) {
  if (owner.empty() && note.job != JobId{}) {  // deleted in the same effects: an earlier event has its owner
    const auto before = std::find_if(events_.rbegin(), events_.rend(),
                                     [&](const RecordedEvent& each) { return each.note.job == note.job; });
    owner = before == events_.rend() ? "" : before->owner;
  }
  note.text = cut_text(printable(note.text), kMaxTextBytes);
  events_.push_back({next_++, unix_ms, std::move(note), std::move(owner)});
  if (events_.size() > kMax) {
    events_.pop_front();
  }
}

FarmEvents::Page FarmEvents::find(const Filter& filter, std::size_t most) const {
  Page page;
  for (auto at = events_.rbegin(); at != events_.rend(); ++at) {
    const Note& note = at->note;
    const bool fits = (filter.before == 0 || at->number < filter.before) && is_of_kind(note, filter.kind) &&
                      (filter.job == JobId{} || note.job == filter.job) &&
                      (filter.worker.empty() || note.worker == filter.worker) &&
                      (note.job == JobId{} || !filter.admits || filter.admits(at->owner));
    if (!fits) {
      continue;
    }
    if (page.events.size() == most) {
      page.next = page.events.back().number;
      break;
    }
    page.events.push_back(*at);
  }
  return page;
}

}  // namespace lightmill

#include "server/access/action_log.h"

#include <algorithm>

#include "common/base/text.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxMessageBytes = 400;
constexpr std::int64_t kDayMs = std::int64_t{24} * 60 * 60 * 1000;
constexpr std::int64_t kSameComingMs = std::int64_t{60} * 60 * 1000;

/// An address without its port. The port changes with every connection.
std::string_view host_of(std::string_view peer) {
  return peer.substr(0, peer.rfind(':'));
}

bool same_coming(const Action& a, const Action& b) {
  return a.caller == b.caller && a.proof == b.proof && a.token == b.token && host_of(a.peer) == host_of(b.peer) &&
         b.unix_ms - a.unix_ms < kSameComingMs;
}

}  // namespace

ActionLog::ActionLog(const ActionLogLimits& limits, std::vector<Action> stored) : limits_(limits) {
  std::ranges::sort(stored, {}, &Action::number);
  for (Action& action : stored) {
    note(action);
    const std::uint64_t number = action.number;
    entries_.emplace(number, std::move(action));
  }
}

ActionLog::Kind ActionLog::kind_of(const Action& action) {
  return action.outcome != StatusCode::kOk ? kRefusal : action.operation == kWorkAction ? kWorker : kChange;
}

void ActionLog::note(const Action& action) {
  const Kind kind = kind_of(action);
  by_kind_[kind].push_back(action.number);
  next_ = action.number + 1;
  if (kind == kWorker) {
    last_came_[action.about] = action.number;
  } else if (action.operation == kStart || action.operation == kTakeOver || action.operation == kStop) {
    at_work_ = action.operation != kStop;
  }
}

void ActionLog::drop_oldest(Kind kind, Change& change) {
  const std::uint64_t number = by_kind_[kind].front();
  by_kind_[kind].pop_front();
  const auto entry = entries_.find(number);
  if (const auto came = last_came_.find(entry->second.about); came != last_came_.end() && came->second == number) {
    last_came_.erase(came);
  }
  entries_.erase(entry);
  change.dropped.push_back(number);
}

ActionLog::Change ActionLog::add(Action action) {
  action.about = as_name(action.about);
  action.message = cut_text(printable(action.message), kMaxMessageBytes);
  action.change = cut_text(printable(action.change), kMaxMessageBytes);
  Change change;
  const Kind kind = kind_of(action);
  if (kind == kWorker) {
    const auto came = last_came_.find(action.about);
    if (came != last_came_.end() && same_coming(entries_.at(came->second), action)) {
      return change;
    }
  }
  action.number = next_;
  note(action);
  entries_.emplace(action.number, action);
  for (int each = 0; each < kKinds; ++each) {
    const std::size_t most = each == kChange ? limits_.entries : std::max<std::size_t>(limits_.entries / 4, 1);
    std::deque<std::uint64_t>& numbers = by_kind_[each];
    while (numbers.size() > most ||
           (!numbers.empty() && entries_.at(numbers.front()).unix_ms < action.unix_ms - limits_.days * kDayMs)) {
      drop_oldest(static_cast<Kind>(each), change);
    }
  }
  change.added = std::move(action);
  return change;
}

ActionPage ActionLog::find(const ActionFilter& filter, std::size_t most) const {
  ActionPage page;
  auto at = filter.before == 0 ? entries_.end() : entries_.lower_bound(filter.before);
  for (std::size_t scanned = 0; at != entries_.begin(); ++scanned) {
    if (page.actions.size() == most || scanned == kMaxScanned) {
      page.next = at->first;
      break;
    }
    const Action& action = (--at)->second;
    if ((filter.job == 0 || action.job == filter.job) && (filter.caller.empty() || action.caller == filter.caller) &&
        action.unix_ms >= filter.since_unix_ms) {
      page.actions.push_back(action);
    }
  }
  return page;
}

std::string peer_text(std::string_view peer) {
  for (const std::string_view scheme : {"ipv4:", "ipv6:"}) {
    if (peer.starts_with(scheme)) {
      peer.remove_prefix(scheme.size());
    }
  }
  std::string text(peer);
  for (const auto& [escape, letter] : {std::pair("%5B", "["), std::pair("%5D", "]"), std::pair("%25", "%")}) {
    if (const std::size_t at = text.find(escape); at != std::string::npos) {
      text.replace(at, 3, letter);
    }
  }
  return as_name(text);
}

}  // namespace lightmill

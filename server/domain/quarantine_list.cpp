#include "server/domain/quarantine_list.h"

#include <fmt/format.h>

#include <algorithm>

namespace lightmill {

bool shares_quarantine(const Renderer& faulty, const Renderer& other) {
  return other.worker == faulty.worker || (!faulty.identity.empty() && other.identity == faulty.identity);
}

bool shares_quarantine(const QuarantineRecord& faulty, const Renderer& other, std::string_view host) {
  return shares_quarantine(faulty.of, other) || (!faulty.host.empty() && host == faulty.host);
}

QuarantineList::QuarantineList(std::vector<QuarantineRecord> stored) {
  for (QuarantineRecord& record : stored) {
    records_[record.of.worker] = std::move(record);
  }
}

bool QuarantineList::contains(const Renderer& renderer, std::string_view host) const {
  return std::ranges::any_of(records_,
                             [&](const auto& entry) { return shares_quarantine(entry.second, renderer, host); });
}

std::string QuarantineList::reason_for(const Renderer& renderer, std::string_view host) const {
  if (const QuarantineRecord* const own = find(renderer.worker)) {
    return own->reason;
  }
  for (const auto& [worker, record] : records_) {
    if (shares_quarantine(record, renderer, host)) {
      if (record.of.worker == renderer.identity) {  // the identity itself was put there
        return record.reason;
      }
      return fmt::format("it has {} in common with {}: {}",
                         record.of.identity == renderer.identity ? "the identity " + renderer.identity : "its host",
                         record.of.worker, record.reason);
    }
  }
  return "";
}

const QuarantineRecord* QuarantineList::find(const std::string& worker) const {
  const auto found = records_.find(worker);
  return found == records_.end() ? nullptr : &found->second;
}

bool QuarantineList::put(const QuarantineRecord& record) {
  const QuarantineRecord* const known = find(record.of.worker);
  // An audit's finding stays. What an operator said can be replaced, but not by nothing: "put there by ada".
  const bool says_why = !record.reason.starts_with(kByHand) || record.reason.find(": ") != std::string::npos;
  const bool news =
      known != nullptr && known->reason.starts_with(kByHand) && says_why && record.reason != known->reason;
  if (known != nullptr && known->of.identity == record.of.identity && !news) {
    return false;
  }
  records_[record.of.worker] = record;
  return true;
}

std::vector<std::string> QuarantineList::release(const Renderer& of, std::string_view host) {
  std::vector<std::string> released;
  for (const auto& [worker, record] : records_) {
    if (shares_quarantine(record, of, host)) {
      released.push_back(worker);
    }
  }
  for (const std::string& worker : released) {
    records_.erase(worker);
  }
  return released;
}

}  // namespace lightmill

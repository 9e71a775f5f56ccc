#include "server/domain/quarantine_list.h"

#include <fmt/format.h>

#include <algorithm>

namespace lightmill {

bool shares_guilt(const Renderer& guilty, const Renderer& other) {
  return other.worker == guilty.worker || (!guilty.machine.empty() && other.machine == guilty.machine);
}

QuarantineList::QuarantineList(std::vector<QuarantineRecord> stored) {
  for (QuarantineRecord& record : stored) {
    records_[record.of.worker] = std::move(record);
  }
}

bool QuarantineList::contains(const Renderer& renderer) const {
  return std::ranges::any_of(records_, [&](const auto& entry) { return shares_guilt(entry.second.of, renderer); });
}

std::string QuarantineList::reason_for(const Renderer& renderer) const {
  if (const QuarantineRecord* const own = find(renderer.worker)) {
    return own->reason;
  }
  for (const auto& [worker, record] : records_) {
    if (shares_guilt(record.of, renderer)) {
      return fmt::format("it is on the machine of {}: {}", record.of.worker, record.reason);
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
  const bool now_proven = known != nullptr && known->reason.starts_with(kByHand) && !record.reason.starts_with(kByHand);
  if (known != nullptr && known->of.machine == record.of.machine && !now_proven) {
    return false;
  }
  records_[record.of.worker] = record;
  return true;
}

std::vector<std::string> QuarantineList::release(const Renderer& of) {
  std::vector<std::string> released;
  for (const auto& [worker, record] : records_) {
    if (shares_guilt(record.of, of)) {
      released.push_back(worker);
    }
  }
  for (const std::string& worker : released) {
    records_.erase(worker);
  }
  return released;
}

}  // namespace lightmill

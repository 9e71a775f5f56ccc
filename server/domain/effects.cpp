#include "server/domain/effects.h"

namespace lightmill {

StoreOp::StoreOp(const StoreOp& other) = default;
StoreOp::StoreOp(StoreOp&& other) noexcept = default;
StoreOp& StoreOp::operator=(const StoreOp& other) = default;
StoreOp& StoreOp::operator=(StoreOp&& other) noexcept = default;
StoreOp::~StoreOp() = default;

std::vector<JobId> ends_in(std::span<const StoreOp> writes) {
  std::vector<JobId> ended;
  for (const StoreOp& op : writes) {
    if (const auto* put = std::get_if<PutJob>(&op); put != nullptr && has_ended(put->record.state)) {
      ended.push_back(put->record.id);
    }
  }
  return ended;
}

std::vector<LeaseId> leases_granted(std::span<const Outgoing> messages) {
  std::vector<LeaseId> leases;
  for (const Outgoing& each : messages) {
    if (const auto* grant = std::get_if<LeaseGrant>(&each.message)) {
      leases.push_back(grant->lease);
    } else if (const auto* pilot = std::get_if<PilotGrant>(&each.message)) {
      leases.push_back(pilot->lease);
    }
  }
  return leases;
}

}  // namespace lightmill

#include "server/domain/stored_rows.h"

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

}  // namespace lightmill

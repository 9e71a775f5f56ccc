#include "server/runtime/outgoing_queue.h"

#include "common/base/overloaded.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxJoinedAcks = 10'000;

std::uint64_t bytes_of(const RenderSettings& settings) {
  return settings.scene->size() + settings.assets->size() * sizeof(Sha256);
}

/// About what the message takes in memory, and more than its parts of variable size.
std::uint64_t bytes_of(const CoordinatorMessage& message) {
  const std::uint64_t parts = std::visit(
      Overloaded{[](const JobDescription& job) { return bytes_of(job.settings); },
                 [](const PilotGrant& pilot) { return bytes_of(pilot.settings); },
                 [](const LeaseGrant& grant) -> std::uint64_t {
                   return grant.unit.tiles.size() * sizeof(TileId) + grant.tags.size() * sizeof(Sha256);
                 },
                 [](const ResultAck& ack) -> std::uint64_t { return ack.keys.size() * sizeof(NodeKey); },
                 [](const LeaseCancel& cancel) -> std::uint64_t { return cancel.leases.size() * sizeof(LeaseId); },
                 [](const InspectGrant& grant) -> std::uint64_t {
                   std::uint64_t bytes = 0;
                   for (const InspectionRequest::File& file : grant.request->files) {
                     bytes += sizeof(file) + file.path.size();
                   }
                   return bytes;
                 },
                 [](const Dismissal& dismissal) -> std::uint64_t { return dismissal.reason.size(); },
                 [](const Notice& notice) -> std::uint64_t { return notice.text.size(); },
                 [](const auto&) { return std::uint64_t{0}; }},
      message);
  return sizeof(CoordinatorMessage) + parts;
}

}  // namespace

void OutgoingQueue::push(CoordinatorMessage message) {
  if (const auto* const ack = std::get_if<ResultAck>(&message); ack != nullptr && !messages_.empty()) {
    if (auto* const last = std::get_if<ResultAck>(&messages_.back());
        last != nullptr && last->keys.size() <= kMaxJoinedAcks) {
      last->keys.insert(last->keys.end(), ack->keys.begin(), ack->keys.end());
      bytes_ += ack->keys.size() * sizeof(NodeKey);
      return;
    }
  }
  bytes_ += bytes_of(message);
  messages_.push_back(std::move(message));
}

CoordinatorMessage OutgoingQueue::pop() {
  CoordinatorMessage first = std::move(messages_.front());
  messages_.pop_front();
  bytes_ -= bytes_of(first);
  return first;
}

void OutgoingQueue::clear() {
  messages_.clear();
  bytes_ = 0;
}

}  // namespace lightmill

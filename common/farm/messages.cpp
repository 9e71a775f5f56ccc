#include "common/farm/messages.h"

namespace lightmill {

WorkerMessage::WorkerMessage(const WorkerMessage& other) = default;
WorkerMessage::WorkerMessage(WorkerMessage&& other) noexcept = default;
WorkerMessage& WorkerMessage::operator=(const WorkerMessage& other) = default;
WorkerMessage& WorkerMessage::operator=(WorkerMessage&& other) noexcept = default;
WorkerMessage::~WorkerMessage() = default;

CoordinatorMessage::CoordinatorMessage(const CoordinatorMessage& other) = default;
CoordinatorMessage::CoordinatorMessage(CoordinatorMessage&& other) noexcept = default;
CoordinatorMessage& CoordinatorMessage::operator=(const CoordinatorMessage& other) = default;
CoordinatorMessage& CoordinatorMessage::operator=(CoordinatorMessage&& other) noexcept = default;
CoordinatorMessage::~CoordinatorMessage() = default;

std::string describe(JobId job, const SampleRange& range) {
  return fmt::format("job {}, samples [{}, {})", job.value, range.first(), range.end());
}

std::string describe(const NodeKey& key) {
  return fmt::format("{}, tile {}", describe(key.job, key.range), key.tile.value);
}

bool has_its_hash(const WorkerResult& result) {
  return hash_of(result.node) == result.hash;
}

}  // namespace lightmill

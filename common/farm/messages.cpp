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

bool has_its_hash(const WorkerResult& result) {
  return hash_of(result.node) == result.hash;
}

}  // namespace lightmill

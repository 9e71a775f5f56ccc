// Queue of messages that a worker has not read yet.
#pragma once

#include <deque>

#include "common/farm/messages.h"

namespace lightmill {

/// Not thread-safe. Its size counts settings of jobs with each message, although messages share them.
class OutgoingQueue {
 public:
  /// Descriptions of 16 of the largest scenes fit. A worker has at most 16 leases.
  static constexpr std::uint64_t kMaxBytes = std::uint64_t{320} << 20;
  static constexpr std::size_t kMaxMessages = 4'096;

  bool empty() const { return messages_.empty(); }
  bool is_full() const { return bytes_ > kMaxBytes || messages_.size() > kMaxMessages; }
  /// Joins an acknowledgement with the last one.
  void push(CoordinatorMessage message);
  CoordinatorMessage pop();  ///< of a queue that is not empty
  void clear();

 private:
  std::deque<CoordinatorMessage> messages_;
  std::uint64_t bytes_ = 0;
};

}  // namespace lightmill

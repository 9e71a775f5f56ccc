// A forked child that computes with bytes from strangers, and reaches nothing of the machine.
#pragma once

#include <chrono>
#include <functional>

#include "common/image/decoder/decoder_protocol.h"
#include "decoder/system_call_filter.h"

namespace lightmill {

struct ChildLimits {
  /// Beyond what the process has: until grow_memory, and at most.
  std::uint64_t memory_bytes = 0, most_memory_bytes = 0;
  std::uint64_t file_bytes = 0;  ///< of a file that it writes
  std::chrono::milliseconds time{0};
};

/// Raises this child's limit of memory to `memory_bytes` beyond what the process had, or to the most that it may have.
void grow_memory(std::uint64_t memory_bytes);

/// Of what the parent has open, the child has two descriptors. They get these numbers.
inline constexpr int kFileDescriptor = 3, kRoomDescriptor = 4;

struct Confinement {
  const SystemCallFilter& filter;
  bool unsandboxed = false;  ///< work also where the kernel refuses the filter
  int asker = -1;            ///< a socket: the child is ended when its other end is closed
};

/// Runs `work` in a child, and waits for its reply, not for its end. The parent has no other children. Its other
/// threads only wait: libraries start some when they are loaded (log4cplus), and a child has none of them. The child
/// has the descriptors `file` and `room`, /dev/null as its standard streams, the filter and the limits. It is ended
/// with this process. However it ends, there is a reply: an error where `work` gave none.
DecodeReply run_confined(const Confinement& confinement, const ChildLimits& limits, int file, int room,
                         const std::function<DecodeReply()>& work);

}  // namespace lightmill

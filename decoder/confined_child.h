// Forked child for computations with untrusted bytes, without access to the machine.
#pragma once

#include <array>
#include <chrono>
#include <functional>

#include "common/image/decoder/decoder_protocol.h"
#include "decoder/system_call_filter.h"

namespace lightmill {

/// Words of messages about the file that the child reads.
struct FileWords {
  const char* what = "the image";
  const char* again = "save the image again";
  const char* otherwise = "save the image again, or in another format";
  const char* smaller = "save it in another format or smaller";
};

struct ChildLimits {
  /// Memory beyond what the process has: before grow_memory, and at most.
  std::uint64_t memory_bytes = 0, most_memory_bytes = 0;
  std::uint64_t file_bytes = 0;  ///< of a file that it writes
  std::chrono::milliseconds time{0};
  FileWords words = {};
};

/// Raises this child's memory limit to `memory_bytes` beyond what the process had, or to the largest allowed.
void grow_memory(std::uint64_t memory_bytes);

/// Numbers of the two descriptors that the child gets from its parent.
inline constexpr int kFileDescriptor = 3, kPixelDescriptor = 4;

struct Confinement {
  const SystemCallFilter& filter;
  bool unsandboxed = false;  ///< work even if the kernel refuses the filter
  int asker = -1;            ///< a socket: the child is killed when its other end closes
};

/// Runs `work` in a child. Waits for its reply, not for its end. The parent must have no other children.
///
/// Other threads of the parent must only wait. Libraries (log4cplus) start some when they are loaded, and a child has
/// none of them. The child gets both `descriptors`, /dev/null as its standard streams, the filter and the limits. They
/// are closed here, so that a pipe among them ends with the child. It is killed with this process. There always is a
/// reply. It is an error if `work` gave none.
DecodeReply run_confined(const Confinement& confinement, const ChildLimits& limits,
                         const std::array<int, 2>& descriptors, const std::function<DecodeReply()>& work);

}  // namespace lightmill

// Filter of system calls (seccomp) for a process that decodes a file.
#pragma once

#include <linux/filter.h>

#include <string>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

/// Allows computation in memory, and use of open descriptors. Everything else raises SIGSYS: opening files, sockets,
/// programs, other processes. Made once, installed in each child.
class SystemCallFilter {
 public:
  static Result<SystemCallFilter> make();
  /// Installs it for this thread, irrevocably. The thread cannot gain privileges any more. FAILED_PRECONDITION if the
  /// kernel refuses.
  Status install() const;

 private:
  std::vector<sock_filter> steps_;
};

/// Name of a system call, such as "openat".
std::string system_call_name(int number);

}  // namespace lightmill

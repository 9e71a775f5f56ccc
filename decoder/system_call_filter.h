// The system calls that are left to a process that decodes an image (seccomp).
#pragma once

#include <linux/filter.h>

#include <string>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

/// Allows what computing in memory and using descriptors that are open takes. All else raises SIGSYS: opening files,
/// sockets, programs, other processes. Made once, installed in each child.
class SystemCallFilter {
 public:
  static Result<SystemCallFilter> make();
  /// For this thread, for good. It cannot gain privileges any more either. FAILED_PRECONDITION if the kernel refuses.
  Status install() const;

 private:
  std::vector<sock_filter> steps_;
};

/// "openat".
std::string system_call_name(int number);

}  // namespace lightmill

// Options for authentication of callers, and their limits.
#pragma once

#include "server/access/call_limits.h"

namespace lightmill {

struct GateOptions {
  bool authenticates = false;  ///< callers must authenticate; otherwise a caller without credentials may do everything
  bool accepts_certificates = false;  ///< an authority signs client certificates
  CallLimitOptions calls;
  bool accepts_tokens = true;  ///< false if the connection is not encrypted, so that others could read tokens
};

}  // namespace lightmill

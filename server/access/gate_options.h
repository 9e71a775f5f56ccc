// What callers are asked for.
#pragma once

#include "server/access/call_limits.h"

namespace lightmill {

struct GateOptions {
  bool asks = false;                ///< callers have to show who they are; else who shows nothing may do everything
  bool takes_certificates = false;  ///< there is an authority that signs theirs
  CallLimitOptions calls;
  bool takes_tokens = true;  ///< false where strangers could read them on the way
};

}  // namespace lightmill

// The last message of a program that runs out of memory.
#pragma once

#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// RESOURCE_EXHAUSTED: what needs too much, how much this process may have, and what to do.
Status out_of_memory(std::string_view what);

/// From now on, a program that runs out of memory or threads ends with a message and this code. This covers exceptions
/// that nothing catches or that leave a noexcept function, in any thread. It also covers libraries that abort or crash
/// where memory is nearly used up. Other aborts and crashes are unchanged. With little address space (ulimit -v),
/// threads share heaps. With `openjd`, the farm manager gets the reason, too. Call it first in main.
void exit_on_out_of_memory(std::string_view program, int exit_code, bool openjd = false);

}  // namespace lightmill

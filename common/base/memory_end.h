// What a program says when its memory ends.
#pragma once

#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// RESOURCE_EXHAUSTED: what takes too much, how much this process may have, and what to do.
Status out_of_memory(std::string_view what);

/// From now on the program ends with a message and this code, in whatever thread, where it would abort for want of
/// memory or of a thread: by an exception, or in a library that calls abort. Other aborts stay as they are. The first
/// thing in main. `openjd`: the farm manager is told, too.
void end_when_memory_ends(std::string_view program, int exit_code, bool openjd = false);

}  // namespace lightmill

// Handling of exhausted memory or threads while a worker prepares, renders or reads: an error instead of a crash.
#pragma once

#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include "common/base/status.h"

namespace lightmill {

/// "out of memory while samples were rendered: …", with advice.
Status out_of_memory_error(std::string_view while_what);
Status out_of_threads_error(std::string_view while_what, const std::system_error& error);

/// Returns the Result of `make`. RESOURCE_EXHAUSTED if memory runs out, or a thread cannot start.
template <class Make>
auto within_limits(std::string_view while_what, const Make& make) -> decltype(make()) {
  try {
    return make();
  } catch (const std::bad_alloc&) {
    return out_of_memory_error(while_what);
  } catch (const std::system_error& error) {
    return out_of_threads_error(while_what, error);
  }
}

}  // namespace lightmill

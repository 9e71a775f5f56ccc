// What a worker does when memory or threads end while it prepares, renders or reads: it says so, and takes other work.
#pragma once

#include <new>
#include <string>
#include <string_view>
#include <system_error>

#include "common/base/status.h"

namespace lightmill {

/// "out of memory while samples were rendered: …", with what to do.
Status memory_ended(std::string_view while_what);
Status threads_ended(std::string_view while_what, const std::system_error& error);

/// What `make` returns, a Result. RESOURCE_EXHAUSTED if memory ends meanwhile, or a thread cannot start.
template <class Make>
auto within_limits(std::string_view while_what, const Make& make) -> decltype(make()) {
  try {
    return make();
  } catch (const std::bad_alloc&) {
    return memory_ended(while_what);
  } catch (const std::system_error& error) {
    return threads_ended(while_what, error);
  }
}

}  // namespace lightmill

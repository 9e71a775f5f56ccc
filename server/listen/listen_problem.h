// Explanation of why an address cannot be bound.
#pragma once

#include <string>
#include <string_view>

namespace lightmill {

/// For an address HOST:PORT that could not be bound: tries again and returns the system's error. `option` is the option
/// that gave the address, such as "--listen".
std::string listen_problem(const std::string& listen, std::string_view option);

}  // namespace lightmill

// Why an address cannot be listened on, in words.
#pragma once

#include <string>
#include <string_view>

namespace lightmill {

/// For an address HOST:PORT that could not be listened on: tries to bind it, and says what the system says. `option` is
/// what it was given by, as "--listen".
std::string listen_problem(const std::string& listen, std::string_view option);

}  // namespace lightmill

// Why an address cannot be listened on, in words.
#pragma once

#include <string>

namespace lightmill {

/// For an address HOST:PORT on which gRPC could not listen: tries to bind it, and says what the system says.
std::string listen_problem(const std::string& listen);

}  // namespace lightmill

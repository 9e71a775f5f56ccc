#include "tests/support/paths.h"

namespace lightmill::test {

std::string source_file(const std::string& name) {
  return std::string(LIGHTMILL_SOURCE_DIR) + "/" + name;
}

std::string program(const std::string& name) {
  return std::string(LIGHTMILL_BINARY_DIR) + "/bin/" + name;
}

}  // namespace lightmill::test

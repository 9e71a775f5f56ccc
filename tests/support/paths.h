// Paths of source files and programs, for tests.
#pragma once

#include <string>

namespace lightmill::test {

/// The path of a file in the checkout, relative to its top: `source_file("scenes/teapot.json")`.
std::string source_file(const std::string& name);
/// The path of a program of this build: `program("lightmill-server")`.
std::string program(const std::string& name);

}  // namespace lightmill::test

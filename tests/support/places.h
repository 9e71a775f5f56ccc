#pragma once

#include <string>

namespace lightmill::test {

/// The path of a file of the checkout, named from its top: `source_file("scenes/cornell.json")`.
std::string source_file(const std::string& name);
/// The path of a program that this build made: `program("lightmill-server")`.
std::string program(const std::string& name);

}  // namespace lightmill::test

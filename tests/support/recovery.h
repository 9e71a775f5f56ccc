// Measurement of the time in which a farm recovers.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <iostream>
#include <string>

#include "tests/support/process.h"

namespace lightmill::test {

/// Waits until `well` returns true, and prints the time: "recovery: after a full disk: 0.61 s".
template <class Condition>
bool recovers(const std::string& what, const Condition& well) {
  const auto begun = std::chrono::steady_clock::now();
  const bool is_well = eventually(well);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  std::cout << fmt::format("recovery: {}: {:.2f} s\n", what, took.count()) << std::flush;
  return is_well;
}

}  // namespace lightmill::test

// Assertions for errors that only a bug can cause. They stay on in release builds.
#pragma once

#include <fmt/format.h>

#include <string>

namespace lightmill {

[[noreturn]] void check_failed(const char* file, int line, const char* condition, const std::string& message);

}  // namespace lightmill

/// Aborts with file, line, condition and an optional formatted message if `condition` is false.
#define LM_CHECK(condition, ...)                                                                \
  do {                                                                                          \
    if (!(condition)) [[unlikely]] {                                                            \
      ::lightmill::check_failed(__FILE__, __LINE__, #condition, ::fmt::format("" __VA_ARGS__)); \
    }                                                                                           \
  } while (false)

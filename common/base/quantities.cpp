#include "common/base/quantities.h"

#include <fmt/format.h>

namespace lightmill {

std::string three_digits(double value) {
  if (value < 9.995) {
    return fmt::format("{:.2f}", value);
  }
  return value < 99.95 ? fmt::format("{:.1f}", value) : fmt::format("{:.0f}", value);
}

std::string counted(std::size_t number, std::string_view noun) {
  return fmt::format("{} {}{}", number, noun, number == 1 ? "" : "s");
}

std::string human_bytes(std::uint64_t bytes) {
  if (bytes < 1024) {
    return fmt::format("{} B", bytes);
  }
  constexpr std::string_view kPrefixes = "KMGT";
  double value = static_cast<double>(bytes) / 1024;
  std::size_t prefix = 0;
  for (; value >= 999.5 && prefix + 1 < kPrefixes.size(); value /= 1024) {
    ++prefix;
  }
  return fmt::format("{} {}iB", three_digits(value), kPrefixes[prefix]);
}

}  // namespace lightmill

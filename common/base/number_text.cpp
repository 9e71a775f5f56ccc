#include "common/base/number_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace lightmill {

std::string significant(double value, int digits) {
  std::string text = fmt::format("{:.{}e}", value, digits - 1);
  const std::size_t at = text.find('e');
  const int exponent = at == std::string::npos ? digits : std::stoi(text.substr(at + 1));
  return exponent < -4 || exponent >= digits ? text : fmt::format("{:.{}f}", value, digits - 1 - exponent);
}

std::string interval_text(double value, double half_width) {
  if (!(half_width > 1e-7 * std::abs(value))) {
    return fmt::format("{:.7g} ± {:.2g}", value, half_width);
  }
  const double largest = std::max(std::abs(value), half_width);
  const int last_place = static_cast<int>(std::floor(std::log10(half_width))) - 1;
  if (largest >= 1e-4 && largest < 1e6) {
    const int decimals = std::max(-last_place, 0);
    return fmt::format("{:.{}f} ± {:.{}f}", value, decimals, half_width, decimals);
  }
  const int first_place = static_cast<int>(std::floor(std::log10(std::max(std::abs(value), half_width / 10))));
  return fmt::format("{:.{}e} ± {:.1e}", value, std::max(first_place - last_place, 0), half_width);
}

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

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

}  // namespace lightmill

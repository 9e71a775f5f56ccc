// Numbers as text for people: counts, byte sizes, and measurements with as many digits as mean something.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace lightmill {

/// The value with `digits` significant digits, including trailing zeros: "7.0", "0.050", "12". Very small numbers, and
/// those with more digits before the point, have an exponent.
std::string significant(double value, int digits);

/// A value and half the width of its interval: "0.1807 ± 0.0034". The half width has two digits. The value ends at the
/// same place, and has seven digits at most. Numbers from 1e6, and very small ones, have an exponent.
std::string interval_text(double value, double half_width);

/// "1 plane", "2 planes".
std::string counted(std::size_t number, std::string_view noun);

/// Three significant digits: "1.50", "45.6", "789".
std::string three_digits(double value);

inline double gib(std::uint64_t bytes) {
  return static_cast<double>(bytes) / (1 << 30);
}

/// "1.5 MiB".
std::string human_bytes(std::uint64_t bytes);

}  // namespace lightmill

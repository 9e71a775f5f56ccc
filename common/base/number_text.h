// Measured numbers as text for people, with as many digits as mean something.
#pragma once

#include <string>

namespace lightmill {

/// So many significant digits, with trailing zeros: "7.0", "0.050", "12". Very small numbers, and those with more digits
/// before the point, have an exponent.
std::string significant(double value, int digits);

/// A value and half the width of its interval: "0.1807 ± 0.0034". The half width has two digits. The value ends at the
/// same place, and has seven digits at most. Numbers from 1e6, and very small ones, have an exponent.
std::string interval_text(double value, double half_width);

}  // namespace lightmill

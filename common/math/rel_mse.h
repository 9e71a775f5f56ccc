// What the error of a picture is divided by: relMSE is the mean of (x − r)² / (r² + kRelMseFloor).
#pragma once

namespace lightmill {

inline constexpr double kRelMseFloor = 0.01;  ///< keeps the dark from deciding

}  // namespace lightmill

// The floor in relMSE, the error of a picture: the mean of (x − r)² / (r² + kRelMseFloor).
#pragma once

namespace lightmill {

inline constexpr double kRelMseFloor = 0.01;  ///< keeps dark pixels from dominating

}  // namespace lightmill

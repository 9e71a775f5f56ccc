// Radiometric and photometric units, and conversions between the strengths of each kind of light.
//
// Power is in W (flux), W/sr (intensity), W/m² (irradiance, exitance) or W/(m² sr) (radiance). The photometric units
// are lm, cd, lx and cd/m², for lengths in metres. There are no spectra. The power of an RGB value (linear, Rec. 709
// primaries) is taken as the luminance-weighted mean of its channels. 1 W is 683 lm, as if all light were at 555 nm,
// the peak of photopic vision.
#pragma once

#include <string_view>

#include "common/math/transcendental.h"
#include "common/math/vec.h"

namespace lightmill {

inline constexpr double kLumenPerWatt = 683;

/// Rec. 709 luminance: the power of an RGB value in the unit of its channels.
inline double luminance(const Vec3d& rgb) {
  return 0.2126 * rgb.x + 0.7152 * rgb.y + 0.0722 * rgb.z;
}

/// W → lm, W/sr → cd, W/m² → lx, W/(m² sr) → cd/m².
inline constexpr double photometric(double radiometric) {
  return kLumenPerWatt * radiometric;
}
/// lm → W, cd → W/sr, lx → W/m², cd/m² → W/(m² sr).
inline constexpr double radiometric(double photometric) {
  return photometric / kLumenPerWatt;
}

/// The multiple of `color` with luminance `amount`; black for a black colour.
inline Vec3d with_luminance(const Vec3d& color, double amount) {
  const double y = luminance(color);
  return y > 0 ? color * (amount / y) : Vec3d(0);
}

// ---- flux of emitters, in W ----

/// Flux over intensity of a point that radiates equally in all directions, in sr.
inline constexpr double kPointSolidAngle = 4 * kPiDouble;

/// Flux over intensity along the axis of I(θ) = I₀ cosⁿθ, θ < 90°: 2π / (n + 1).
inline constexpr double cosine_power_solid_angle(double exponent) {
  return 2 * kPiDouble / (exponent + 1);
}

/// Flux over intensity of a spot. Its intensity is full within `inner` and falls off smoothly (t²(3 − 2t) in the
/// cosine) to zero at `outer`. Both angles are given as 1 − cos.
inline constexpr double spot_solid_angle(double inner, double outer) {
  return kPiDouble * (inner + outer);
}

/// Exitance over radiance along the normal of a surface with L(θ) = L₀ cosⁿθ: 2π / (n + 2), which is π for n = 0.
inline constexpr double exitance_per_radiance(double exponent = 0) {
  return 2 * kPiDouble / (exponent + 2);
}

/// The same for L(θ) = L₀ (1 − tan θ / tan h) within the half angle h = `spread`/2: π (1 − h cot h).
inline double spread_exitance_per_radiance(double spread) {
  const double half = spread / 2;
  return kPiDouble * (1 - half * cos_fixed(half) / sin_fixed(half));
}

/// Irradiance of a surface under constant radiance L from its whole hemisphere, over L.
inline constexpr double kHemisphereIrradiance = kPiDouble;

// ---- strengths as users give them ----

enum class LightQuantity { flux, intensity, irradiance, radiance };

/// A unit of a light's strength. For surfaces that emit, `irradiance` is exitance.
struct LightUnit {
  std::string_view name;  ///< as in scene documents
  LightQuantity quantity;
  bool photometric;
};

inline constexpr LightUnit kLightUnits[] = {
    {"watt", LightQuantity::flux, false},
    {"watt_per_steradian", LightQuantity::intensity, false},
    {"watt_per_square_metre", LightQuantity::irradiance, false},
    {"watt_per_square_metre_steradian", LightQuantity::radiance, false},
    {"lumen", LightQuantity::flux, true},
    {"candela", LightQuantity::intensity, true},
    {"lux", LightQuantity::irradiance, true},
    {"candela_per_square_metre", LightQuantity::radiance, true},
};

/// The amount in W, W/sr, W/m² or W/(m² sr).
inline constexpr double radiometric_amount(const LightUnit& unit, double amount) {
  return unit.photometric ? radiometric(amount) : amount;
}

}  // namespace lightmill

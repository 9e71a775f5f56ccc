// The unit library, compared with the figures of a university rendering course, other parameters, and integrals by an
// independent rule.
#include "common/lights/photometry.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

namespace lightmill {
namespace {

/// ∫ f(θ) 2π sinθ dθ over [0, end], by the midpoint rule.
double over_solid_angle(const std::function<double(double)>& f, double end) {
  constexpr int kSteps = 200'000;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double theta = end * (i + 0.5) / kSteps;
    sum += f(theta) * 2 * M_PI * std::sin(theta);
  }
  return sum * end / kSteps;
}

double sphere_area_of_diameter(double diameter) {
  return kPiDouble * diameter * diameter;
}

/// Irradiance at a distance from a source of this intensity, on a surface inclined by θ.
double irradiance_at(double intensity, double distance, double cos_theta = 1) {
  return intensity * cos_theta / (distance * distance);
}

/// Energy of a flux over a time, in J.
double radiant_energy(double watt, double seconds) {
  return watt * seconds;
}

/// Photons per second in a flux of one wavelength: P λ / (h c), with the exact constants of the SI.
double photons_per_second(double watt, double wavelength_m) {
  constexpr double kPlanck = 6.62607015e-34, kLightSpeed = 299'792'458;
  return watt * wavelength_m / (kPlanck * kLightSpeed);
}

/// Electrical power of a bulb, which is its radiant power if nothing is lost: V · A.
double electrical_watt(double volt, double ampere) {
  return volt * ampere;
}

TEST(Photometry, ABulbHasKnownPowerIntensityAndExitance) {
  const double watt = electrical_watt(2.4, 0.7);
  EXPECT_NEAR(watt, 1.68, 1e-12);
  EXPECT_NEAR(watt / kPointSolidAngle, 0.13369, 5e-6);
  EXPECT_NEAR(watt / sphere_area_of_diameter(0.01), 5347.6, 0.05);
  EXPECT_NEAR(radiant_energy(watt, 5 * 60), 504, 1e-9);
}

TEST(Photometry, GreenLightHasAKnownPhotonRate) {
  EXPECT_NEAR(photons_per_second(5, 500e-9), 1.2585e19, 5e14);
  // Twice the wavelength, twice the photons.
  EXPECT_NEAR(photons_per_second(5, 1000e-9) / photons_per_second(5, 500e-9), 2, 1e-12);
}

TEST(Photometry, ASquareEmitterHasKnownExitanceAndFlux) {
  const double area = 0.1 * 0.1;
  EXPECT_NEAR(5000 * exitance_per_radiance(), 15708, 0.05);
  EXPECT_NEAR(5000 * exitance_per_radiance() * area, 157.080, 5e-4);
  EXPECT_NEAR(6000 * exitance_per_radiance(1) * area, 125.664, 5e-4);
}

TEST(Photometry, LuminousEfficacyIs683InBothDirections) {
  EXPECT_EQ(photometric(1), 683);
  EXPECT_EQ(radiometric(683), 1);
  for (const LightUnit& unit : kLightUnits) {
    EXPECT_DOUBLE_EQ(radiometric_amount(unit, 100), unit.photometric ? 100.0 / 683 : 100) << unit.name;
  }
}

TEST(Photometry, FluxIsTheIntegralOfTheIntensity) {
  EXPECT_NEAR(kPointSolidAngle, over_solid_angle([](double) { return 1; }, M_PI), 1e-6);
  for (const double n : {0.0, 1.0, 2.5, 42.0}) {
    const auto cosine = [n](double theta) { return std::pow(std::cos(theta), n); };
    EXPECT_NEAR(cosine_power_solid_angle(n), over_solid_angle(cosine, M_PI / 2), 1e-6) << n;
    const auto projected = [n](double theta) { return std::pow(std::cos(theta), n + 1); };
    EXPECT_NEAR(exitance_per_radiance(n), over_solid_angle(projected, M_PI / 2), 1e-6) << n;
  }
  for (const auto& [inner, outer] : {std::pair(0.0, 0.5), {0.4, 0.5}, {0.2, 1.5}, {1.0, 3.0}}) {
    const double ci = std::cos(inner), co = std::cos(outer);
    const auto falloff = [=](double theta) {
      const double t = std::clamp((std::cos(theta) - co) / (ci - co), 0.0, 1.0);
      return t * t * (3 - 2 * t);
    };
    EXPECT_NEAR(spot_solid_angle(1 - ci, 1 - co), over_solid_angle(falloff, outer), 1e-6) << inner << ' ' << outer;
  }
}

TEST(Photometry, ADistantSphereHasTheIrradianceOfItsIntensity) {
  // The irradiance of a sphere of exitance πL is E = πL(R/d)², that of a point of intensity Φ / 4π.
  const double radiance = 7, diameter = 0.3, distance = 2.5;
  const double flux = exitance_per_radiance() * radiance * sphere_area_of_diameter(diameter);
  EXPECT_NEAR(irradiance_at(flux / kPointSolidAngle, distance), M_PI * radiance * std::pow(diameter / 2 / distance, 2),
              1e-12);
  EXPECT_NEAR(irradiance_at(3, 2, 0.5), 0.375, 1e-15);
}

TEST(Photometry, ColoursKeepTheirRatioAndTakeTheLuminance) {
  const Vec3d rgb = with_luminance({2, 1, 0.5}, 10);
  EXPECT_NEAR(luminance(rgb), 10, 1e-12);
  EXPECT_NEAR(rgb.x / rgb.y, 2, 1e-12);
  EXPECT_NEAR(rgb.y / rgb.z, 2, 1e-12);
  const Vec3d white = with_luminance({1, 1, 1}, 10);
  EXPECT_NEAR(white.x, 10, 1e-12);
  EXPECT_EQ(with_luminance({0, 0, 0}, 10), Vec3d(0));
}

}  // namespace
}  // namespace lightmill

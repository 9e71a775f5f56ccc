// Spectra as colours. Expected values are chromaticities that the CIE and its observer define.
#include "common/scene_io/spectrum.h"

#include <gtest/gtest.h>

#include "common/base/status.h"

namespace lightmill {
namespace {

void expect_near(const RgbColor& color, const RgbColor& expected, double tolerance, const std::string& what) {
  EXPECT_NEAR(color.r, expected.r, tolerance) << what;
  EXPECT_NEAR(color.g, expected.g, tolerance) << what;
  EXPECT_NEAR(color.b, expected.b, tolerance) << what;
}

Spectrum constant(double value) {
  return {{300, 900}, {value, value}};
}

TEST(Spectra, AreLinearBetweenTheirValuesAndZeroOutside) {
  const Spectrum s{{400, 500, 700}, {1, 3, 1}};
  EXPECT_EQ(s.at(399), 0);
  EXPECT_EQ(s.at(400), 1);
  EXPECT_EQ(s.at(450), 2);
  EXPECT_EQ(s.at(600), 2);
  EXPECT_EQ(s.at(700), 1);
  EXPECT_EQ(s.at(701), 0);
}

TEST(Spectra, GreyReflectsGrey) {
  for (const float value : {0.0f, 0.18f, 1.0f}) {
    expect_near(reflected_color(constant(value)), {value, value, value}, 1e-6, "grey");
  }
}

TEST(Spectra, LightHasLuminanceOne) {
  for (const double kelvin : {2000.0, 4000.0, 6500.0, 20000.0}) {
    const RgbColor color = light_color(blackbody(kelvin)).value();
    EXPECT_NEAR(0.2126 * color.r + 0.7152 * color.g + 0.0722 * color.b, 1, 1e-3) << kelvin;
  }
  EXPECT_FALSE(light_color(constant(0)).has_value());
}

// The chromaticity (1/3, 1/3) of equal energy, in linear Rec. 709: XYZ = (1, 1, 1).
TEST(Spectra, EqualEnergyHasItsChromaticity) {
  expect_near(light_color(constant(7)).value(), {1.2048f, 0.9483f, 0.9089f}, 0.02, "E");
}

// CIE 15:2004 gives illuminant A, a black body of 2856 K, the chromaticity (0.4476, 0.4074).
TEST(Spectra, BlackBodyOf2856KelvinIsIlluminantA) {
  const RgbColor body = light_color(blackbody(2856)).value(), named = illuminant_color("A").value();
  expect_near(body, named, 0.03, "A");
  const double x = 0.4476, y = 0.4074, z = 1 - x - y;
  expect_near(named,
              {static_cast<float>((3.2406 * x - 1.5372 * y - 0.4986 * z) / y),
               static_cast<float>((-0.9689 * x + 1.8758 * y + 0.0415 * z) / y),
               static_cast<float>((0.0557 * x - 0.2040 * y + 1.0570 * z) / y)},
              2e-3, "its name");
}

TEST(Spectra, D65IsWhite) {
  expect_near(illuminant_color("D65").value(), {1, 1, 1}, 0, "by name");
  // Coarse values of D65: one every 50 nm.
  expect_near(
      light_color({{350, 400, 450, 500, 550, 600, 650, 700, 750}, {44.9, 82.7, 117, 109.4, 104, 90, 80, 71.6, 63.6}})
          .value(),
      {1, 1, 1}, 0.04, "by values");
  EXPECT_FALSE(illuminant_color("D66").has_value());
}

TEST(Spectra, MetalsAndGlassesHaveValuesAtGivenWavelengths) {
  EXPECT_EQ(at_red_green_blue({{450, 550, 650}, {1, 2, 3}}), (RgbColor{3, 2, 1}));
  // Schott's data sheet: n_d of N-BK7.
  EXPECT_EQ(glass_ior("BK7"), 1.5168);
  EXPECT_FALSE(glass_ior("BK8").has_value());
}

}  // namespace
}  // namespace lightmill

// pbrt's conventions, rendered: what a file means by its cameras, lights and media, against closed forms.
#include <cmath>
#include <numbers>

#include "common/base/file.h"
#include "tests/analytic/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

using std::numbers::pi;

TestScene pbrt_scene(const std::string& text) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "scene.pbrt";
  EXPECT_TRUE(write_file_atomically(path, as_byte_view(text)).ok());
  return TestScene(path);
}

std::string film_of(int width, int height) {
  return fmt::format(R"(PixelFilter "box" Film "rgb" "integer xresolution" {} "integer yresolution" {} )", width,
                     height);
}

/// A glowing rectangle in a plane of constant z, which shines on both sides.
std::string glowing(double x0, double x1, double y0, double y1, double z,
                    const std::string& light = "\"rgb L\" [1 1 1]") {
  return fmt::format(R"(Material "diffuse" "rgb reflectance" [0 0 0]
AreaLightSource "diffuse" "bool twosided" true {5}
Shape "bilinearmesh" "point3 P" [{0} {2} {4} {1} {2} {4} {0} {3} {4} {1} {3} {4}]
)",
                     x0, x1, y0, y1, z, light);
}

// The field of view covers [-1, 1] of the shorter side at distance 1. x is on the right, and y up.
TEST(PbrtAnswers, FieldOfViewIsAlongTheShorterSide) {
  const std::string camera = R"(Camera "perspective" "float fov" 90 )";
  const auto wide =
      pbrt_scene(camera + film_of(40, 20) + "WorldBegin\n" + glowing(1, 9, -9, 9, 1)).render({"path", 1, 0}, 1);
  EXPECT_EQ(line_of(wide, true), lit_from(30, 40, 40));
  const auto high =
      pbrt_scene(camera + film_of(20, 40) + "WorldBegin\n" + glowing(-9, 9, 1, 9, 1)).render({"path", 1, 0}, 1);
  EXPECT_EQ(line_of(high, false), lit_from(0, 10, 40));
}

// pbrt's LookAt puts up × ahead on the right. A scale of -1 of the camera's x puts it on the left, as most files do.
TEST(PbrtAnswers, CamerasMirrorAsTheFileSays) {
  for (const bool mirrored : {false, true}) {
    const auto image = pbrt_scene(std::string(mirrored ? "Scale -1 1 1 " : "") +
                                  "LookAt 0 0 5 0 0 0 0 1 0 Camera \"perspective\" \"float fov\" 90 " + film_of(8, 8) +
                                  "WorldBegin\n" + glowing(0, 99, -99, 99, 0))
                           .render({"path", 1, 0}, 1);
    // +z comes towards the camera, so an unmirrored view has +x on the right.
    EXPECT_EQ(line_of(image, true), mirrored ? lit_from(4, 8, 8) : lit_from(0, 4, 8)) << mirrored;
  }
}

TEST(PbrtAnswers, EmittersShowTheirRadianceTimesTheExposure) {
  const auto scene = pbrt_scene(R"(Camera "perspective" "float shutterclose" 0.5 )" + film_of(4, 4) +
                                "\"float iso\" 400\nWorldBegin\n" +
                                glowing(-99, 99, -99, 99, 1, "\"rgb L\" [1 2 3] \"float scale\" 0.5"));
  const auto image = scene.render({"path", 1, 0}, 1);
  for (int channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(mean_of(image, channel).value, 0.5 * 0.5 * 4 * (channel + 1), 1e-6) << channel;
  }
}

/// A white plane z = 2 that the camera at the origin sees along its normal.
std::string lit_wall(const std::string& light) {
  return R"(Camera "perspective" "float fov" 0.01 )" + film_of(2, 2) + "WorldBegin\n" + light +
         R"( Shape "bilinearmesh" "point3 P" [-50 -50 2 -50 50 2 50 -50 2 50 50 2])";
}

// L = ρ/π · Φ/(4π) / d², with ρ = 1/2 and d = 1.
TEST(PbrtAnswers, PointLightsRadiateTheirPower) {
  const auto image =
      pbrt_scene(lit_wall(R"(LightSource "point" "point3 from" [0 0 1] "float power" 30)")).render({"path", 1, 1}, 1);
  EXPECT_NEAR(mean_of(image, 0).value, 0.5 / pi * 30 / (4 * pi), 1e-4);
}

// Within its inner cone a spot has Φ / (2π((1 − cos a) + (cos a − cos b)/2)).
TEST(PbrtAnswers, SpotsRadiateTheirPower) {
  const auto image =
      pbrt_scene(
          lit_wall(
              R"(LightSource "spot" "point3 from" [0 0 1] "point3 to" [0 0 2] "float power" 30 "float coneangle" 60 "float conedeltaangle" 15)"))
          .render({"path", 1, 1}, 1);
  const double solid_angle = 2 * pi * ((1 - std::sqrt(0.5)) + (std::sqrt(0.5) - 0.5) / 2);
  EXPECT_NEAR(mean_of(image, 0).value, 0.5 / pi * 30 / solid_angle, 1e-4);
}

// A distant light that comes along 60° off the normal: L = ρ/π · E cos 60°.
TEST(PbrtAnswers, DistantLightsHaveTheirIrradiance) {
  const auto image =
      pbrt_scene(
          lit_wall(R"(LightSource "distant" "point3 from" [0 1.7320508 -1] "point3 to" [0 0 0] "float illuminance" 8)"))
          .render({"path", 1, 1}, 1);
  EXPECT_NEAR(mean_of(image, 0).value, 0.5 / pi * 8 * 0.5, 1e-4);
}

// A uniform sky through a ball of radius 1 that absorbs σ: exp(−2σ) on the axis.
TEST(PbrtAnswers, InterfacesBoundTheirMedium) {
  const auto image = pbrt_scene(R"(Camera "perspective" "float fov" 0.01 )" + film_of(2, 2) + R"(WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [0.25 0.5 1] "rgb sigma_s" [0 0 0]
Translate 0 0 3 MediumInterface "fog" "" Material "interface" Shape "sphere")")
                         .render({"path", 4, 4}, 1);
  for (const auto& [channel, sigma] : {std::pair{0, 0.25}, {1, 0.5}, {2, 1.0}}) {
    EXPECT_NEAR(mean_of(image, channel).value, std::exp(-2 * sigma), 1e-4) << channel;
  }
}

// White bodies hide in a uniform sky, by coefficients and by reflectance.
TEST(PbrtAnswers, WhiteSubsurfacePassesTheWhiteFurnaceTest) {
  for (const char* const body : {R"("rgb sigma_a" [0 0 0] "rgb sigma_s" [2 1 0.5] "float scale" 2)",
                                 R"("rgb reflectance" [1 1 1] "rgb mfp" [0.25 0.5 1])"}) {
    const auto image = pbrt_scene(R"(Camera "perspective" "float fov" 20 )" + film_of(8, 8) + R"(WorldBegin
LightSource "infinite" "rgb L" [1 1 1]
Translate 0 0 3 Material "subsurface" )" +
                                  body + R"( Shape "sphere")")
                           .render({"path", 4, 0}, 8);
    for (int channel = 0; channel < 3; ++channel) {
      expect_answer(mean_of(image, channel), 1, 1e-2);
    }
  }
}

}  // namespace
}  // namespace lightmill::test

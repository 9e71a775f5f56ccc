// Mitsuba's conventions, rendered: what a file means by its sensors, emitters, shapes and textures, against closed forms.
#include <cmath>
#include <numbers>

#include "common/base/file.h"
#include "tests/analytic/scene_text.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

using std::numbers::pi;

/// A scene whose camera is at the origin and looks along +z, with a field of view of `fov` degrees along x.
HalfImages render_xml(const std::string& body, double fov, int width, int height, const MethodSettings& settings,
                      std::uint32_t level = 1, const CompiledScene::ImageDecoder& images = nullptr,
                      const std::map<std::string, std::string>& files = {}) {
  const TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "scene.xml";
  const std::string text =
      fmt::format(R"(<scene version="3.0.0"><sensor type="perspective"><float name="fov" value="{}"/>
<film type="hdrfilm"><integer name="width" value="{}"/><integer name="height" value="{}"/><rfilter type="box"/></film></sensor>
{}</scene>)",
                  fov, width, height, body);
  EXPECT_TRUE(write_file_atomically(path, as_byte_view(text)).ok());
  for (const auto& [name, bytes] : files) {
    EXPECT_TRUE(write_file_atomically(folder.path() / name, as_byte_view(bytes)).ok());
  }
  return TestScene(path, images).render(settings, level);
}

std::string radiance(const std::string& rgb) {
  return "<emitter type=\"area\"><rgb name=\"radiance\" value=\"" + rgb + "\"/></emitter>";
}

/// A shape under the steps of a transform.
std::string moved(const std::string& type, const std::string& steps, const std::string& content) {
  return "<shape type=\"" + type + "\"><transform name=\"to_world\">" + steps + "</transform>" + content + "</shape>";
}

constexpr const char* kFacing = R"(<rotate y="1" angle="180"/>)";  ///< turns a rectangle to the camera

// The film covers [-1, 1] along x at distance 1. +x is on the left, +y is up. A rectangle shines along its +z.
TEST(MitsubaAnswers, PlusXIsOnTheLeft) {
  const std::string left = moved("rectangle", std::string(kFacing) + R"(<translate x="1" z="1"/>)", radiance("1"));
  EXPECT_EQ(line_of(render_xml(left, 90, 8, 4, {"path", 1, 0}), true), lit_from(0, 4, 8));
  const std::string up =
      moved("rectangle", std::string(kFacing) + R"(<scale value="9"/><translate y="9" z="1"/>)", radiance("1"));
  EXPECT_EQ(line_of(render_xml(up, 90, 8, 8, {"path", 1, 0}), false), lit_from(0, 4, 8));
  const std::string away = moved("rectangle", R"(<translate z="1"/>)", radiance("1"));
  EXPECT_EQ(line_of(render_xml(away, 90, 8, 4, {"path", 1, 0}), true), lit_from(0, 0, 8));
}

/// A grey wall at z = 2 that faces the camera. Its albedo is 1/2.
std::string wall(double size = 50) {
  return moved("rectangle", fmt::format(R"({}<scale value="{}"/><translate z="2"/>)", kFacing, size),
               "<bsdf type=\"twosided\"><bsdf type=\"diffuse\"/></bsdf>");
}

// L = ρ/π · I / d².
TEST(MitsubaAnswers, PointEmittersHaveTheirIntensity) {
  const auto image = render_xml(wall() + R"(<emitter type="point"><point name="position" x="0" y="0" z="1"/>
<rgb name="intensity" value="3, 6, 9"/></emitter>)",
                                0.01, 2, 2, {"path", 1, 1});
  for (int channel = 0; channel < 3; ++channel) {
    EXPECT_NEAR(mean_of(image, channel).value, 0.5 / pi * 3 * (channel + 1), 1e-4) << channel;
  }
}

// Light along 60° off the normal: L = ρ/π · E cos 60°.
TEST(MitsubaAnswers, DirectionalEmittersHaveTheirIrradiance) {
  const auto image = render_xml(wall() + R"(<emitter type="directional">
<vector name="direction" x="0" y="-1.7320508" z="1"/><rgb name="irradiance" value="8"/></emitter>)",
                                0.01, 2, 2, {"path", 1, 1});
  EXPECT_NEAR(mean_of(image, 0).value, 0.5 / pi * 8 * 0.5, 1e-4);
}

// Within its beam a spot has its intensity, and beyond its cutoff nothing.
TEST(MitsubaAnswers, SpotsShineAlongTheirZ) {
  const auto spot = [](const std::string& target) {
    return wall() + R"(<emitter type="spot"><transform name="to_world"><lookat origin="0, 0, 1" target=")" + target +
           R"(" up="0, 1, 0"/></transform><rgb name="intensity" value="4"/><float name="cutoff_angle" value="20"/></emitter>)";
  };
  EXPECT_NEAR(mean_of(render_xml(spot("0, 0, 2"), 0.01, 2, 2, {"path", 1, 1}), 0).value, 0.5 / pi * 4, 1e-4);
  EXPECT_EQ(mean_of(render_xml(spot("1, 0, 2"), 0.01, 2, 2, {"path", 1, 1}), 0).value, 0);
}

// A square of side 4 behind the camera, at distance 2.5 from the wall, whose middle is seen. The factor of a corner is
// (s atan s)/π with s = x/√(1 + x²), where x is the side over the distance (Siegel and Howell), and there are four.
TEST(MitsubaAnswers, RectanglesLightAsTheirFormFactorSays) {
  const auto image =
      render_xml(wall() + moved("rectangle", R"(<scale value="2"/><translate z="-0.5"/>)", radiance("1")), 0.01, 4, 4,
                 {"path", 1, 1}, 10);
  const double x = 2 / 2.5, s = x / std::sqrt(1 + x * x);
  expect_answer(mean_of(image, 0), 0.5 * 4 * s * std::atan(s) / pi, 0.01);
}

// In a closed sphere of albedo ρ whose walls radiate E, the radiance is E / (1 − ρ).
TEST(MitsubaAnswers, FurnaceHasItsRadiance) {
  const auto image = render_xml(R"(<shape type="sphere"><float name="radius" value="3"/>
<boolean name="flip_normals" value="true"/><bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>)" +
                                    radiance("1") + "</shape>",
                                60, 4, 4, {"path", 64, 64}, 8);
  expect_answer(mean_of(image, 0), 2, 0.02);
}

// Plastic of index n in a white furnace: a white base gives all light back.
TEST(MitsubaAnswers, WhitePlasticGivesAllLightBack) {
  const auto image = render_xml(R"(<emitter type="constant"><rgb name="radiance" value="1"/></emitter>
<shape type="sphere"><point name="center" x="0" y="0" z="3"/><bsdf type="plastic">
<rgb name="diffuse_reflectance" value="1"/></bsdf></shape>)",
                                20, 4, 4, {"path", 8, 8}, 8);
  expect_answer(mean_of(image, 0), 1, 0.02);
}

/// An image of single values, in rows from the top.
CompiledScene::ImageDecoder image_of(int width, const std::vector<float>& values) {
  return [width, values](ByteView, const std::string&) -> Result<Texels> {
    std::vector<float> texels;
    for (const float value : values) {
      texels.insert(texels.end(), {value, value, value, 1});
    }
    return Texels{width, static_cast<int>(values.size()) / width, {}, std::move(texels), false};
  };
}

// Mitsuba's v grows from the top of the image, and a rectangle's along its y. Facing the camera, its x is on the left.
TEST(MitsubaAnswers, BitmapsLieOnRectanglesAsInMitsuba) {
  const std::string screen = moved("rectangle", std::string(kFacing) + R"(<translate z="1"/>)",
                                   R"(<emitter type="area"><texture name="radiance" type="bitmap">
<string name="filename" value="a.exr"/><string name="filter_type" value="nearest"/></texture></emitter>)");
  const auto image = render_xml(screen, 90, 2, 2, {"path", 1, 0}, 1, image_of(2, {1, 2, 3, 4}), {{"a.exr", "image"}});
  const auto at = [&](std::size_t pixel) { return image.mean(3 * pixel); };
  EXPECT_EQ(at(0), 3);
  EXPECT_EQ(at(1), 4);
  EXPECT_EQ(at(2), 1);
  EXPECT_EQ(at(3), 2);
}

/// An environment that is 1 about +z, 2 about +x, 3 about -z, 4 about -x, 5 about +y and 6 about -y, by Mitsuba's rule:
/// u = atan2(x, -z)/2π, and v is the angle to +y over π.
CompiledScene::ImageDecoder six_sides() {
  constexpr int kWidth = 64, kHeight = 32;
  std::vector<float> values;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const double phi = (x + 0.5) / kWidth * 2 * pi, theta = (y + 0.5) / kHeight * pi;
      const double dx = std::sin(phi) * std::sin(theta), dz = -std::cos(phi) * std::sin(theta), dy = std::cos(theta);
      values.push_back(dy > 0.8                      ? 5.0f
                       : dy < -0.8                   ? 6.0f
                       : std::abs(dx) > std::abs(dz) ? (dx > 0 ? 2.0f : 4.0f)
                                                     : (dz > 0 ? 1.0f : 3.0f));
    }
  }
  return image_of(kWidth, values);
}

// The camera sees the direction that the turn takes to +z.
TEST(MitsubaAnswers, EnvironmentsAreTurnedByTheirTransform) {
  const std::vector<std::pair<std::string, double>> cases{{"", 1},
                                                          {R"(<rotate y="1" angle="90"/>)", 4},
                                                          {R"(<rotate y="1" angle="-90"/>)", 2},
                                                          {R"(<rotate y="1" angle="180"/>)", 3},
                                                          {R"(<rotate x="1" angle="90"/>)", 5},
                                                          {R"(<rotate x="1" angle="-90"/>)", 6},
                                                          {R"(<rotate z="1" angle="90"/>)", 1}};
  for (const auto& [steps, value] : cases) {
    const auto image = render_xml(
        "<emitter type=\"envmap\"><string name=\"filename\" value=\"sky.exr\"/>"
        "<transform name=\"to_world\">" +
            steps + "</transform></emitter>" + moved("sphere", R"(<scale value="0.1"/><translate z="-9"/>)", ""),
        1, 2, 2, {"path", 1, 0}, 1, six_sides(), {{"sky.exr", "image"}});
    EXPECT_NEAR(mean_of(image, 0).value, value, 1e-5) << steps;
  }
}

}  // namespace
}  // namespace lightmill::test

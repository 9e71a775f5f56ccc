// Photons that media scatter, against exact answers. No path from the camera finds this light.
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/analytic/meter_text.h"
#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

std::string rgb(const Vec3d& v) {
  return fmt::format(R"({{"rgb": [{}, {}, {}]}})", v.x, v.y, v.z);
}

struct Medium {
  Vec3d scattering{0}, absorption{0};
  double anisotropy = 0;
  Vec3d extinction() const { return scattering + absorption; }
  std::string text(const std::string& name, double ior) const {
    return fmt::format(R"({{"name": "{}", "dielectric": {{"ior": {}}}, "interior": {{
        "scattering": {}, "absorption": {}, "anisotropy": {}}}}})",
                       name, ior, rgb(scattering), rgb(absorption), anisotropy);
  }
};

/// Henyey and Greenstein's function of the cosine between the directions before and after.
double phase(double g, double cosine) {
  return (1 - g * g) / (4 * std::numbers::pi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

/// Fog of radius 12 around (0, −1, 0), which the mirror y = −1 halves. So light by way of the mirror is that of a second
/// lamp in a whole ball. The camera is at the origin and looks up, past the mirror and below the lamp.
constexpr double kFieldOfView = 30, kRise = 0.5;
const Vec3d kFogCenter{0, -1, 0}, kLamp{0.5, 3, 0.5}, kImage{0.5, -5, 0.5};
constexpr double kFogRadius = 12;

TestScene mirror_scene(const Medium& fog, int size = 16) {
  return TestScene::from_text(
      document(fmt::format(R"("eye": [0, 0, 0], "look_at": [0, {}, -1])", kRise), kFieldOfView, size,
               R"({"name": "mirror", "mirror": {}})" + also(fog.text("fog", 1)),
               plane_shape("mirror", "[0, -1, 0]", "[0, 1, 0]") + also(sphere("fog", "[0, -1, 0]", kFogRadius)),
               fmt::format(R"({{"point": {{"position": [{}, {}, {}], "intensity": {}}}}})", kLamp.x, kLamp.y, kLamp.z,
                           gray(1))));
}

/// Mean over the picture of the light of a lamp of intensity 1 that the fog scatters once.
double scattered_once(const Medium& fog, const Vec3d& lamp, int channel) {
  const Vec3d forward = glm::normalize(Vec3d(0, kRise, -1)), right(1, 0, 0), up = glm::cross(right, forward);
  const double half = std::tan(kFieldOfView / 2 * std::numbers::pi / 180);
  constexpr int kPixels = 24, kSteps = 4000;
  const double sigma = fog.extinction()[channel];
  double sum = 0;
  for (int i = 0; i < kPixels; ++i) {
    for (int j = 0; j < kPixels; ++j) {
      const Vec3d w = glm::normalize(forward + right * (half * (2 * (i + 0.5) / kPixels - 1)) +
                                     up * (half * (2 * (j + 0.5) / kPixels - 1)));
      const double b = -glm::dot(w, kFogCenter);
      const double end = -b + std::sqrt(b * b - glm::dot(kFogCenter, kFogCenter) + kFogRadius * kFogRadius);
      for (int k = 0; k < kSteps; ++k) {
        const double distance = end * (k + 0.5) / kSteps;
        const Vec3d to_lamp = lamp - w * distance;
        const double d = glm::length(to_lamp);
        // Light travels along −to_lamp, then back to the camera along −w.
        sum += end / kSteps * fog.scattering[channel] * phase(fog.anisotropy, glm::dot(to_lamp / d, w)) *
               std::exp(-sigma * (distance + d)) / (d * d);
      }
    }
  }
  return sum / (kPixels * kPixels);
}

const std::vector<Medium> kFogs{{.scattering = {0.1, 0.2, 0.3}},
                                {.scattering = {0.02, 0.3, 0.1}, .absorption = {0.1, 0, 0.3}, .anisotropy = 0.6}};

/// The light that photons bring alone.
HalfImages photon_light(const TestScene& scene, const std::string& method, std::uint32_t max_bounces,
                        std::uint32_t level) {
  const std::vector<LayerSpec> layers = *film_layers(std::vector<std::string>{"caustic"});
  constexpr std::size_t kAfterBeauty = 3;
  return scene.render({method, 31, max_bounces, layers}, level, {}, kAfterBeauty);
}

TEST(PhotonsInMedia, LightByWayOfAMirrorIsThatOfTheImage) {
  for (const Medium& fog : kFogs) {
    const HalfImages image = photon_light(mirror_scene(fog), "caustic:photons=30000", 2, 6);
    EXPECT_EQ(image.non_finite, 0u);
    for (int channel = 0; channel < 3; ++channel) {
      expect_answer(mean_of(image, channel), scattered_once(fog, kImage, channel), 6e-2);
    }
  }
}

// `ppm` has photons only. Its blur loses light where the ball of a gather leaves the fog.
TEST(PhotonsInMedia, PpmFindsTheLightOfALampInFog) {
  for (const Medium& fog : kFogs) {
    const HalfImages image = mirror_scene(fog).render({"ppm:photons=50000", 33, 1}, 5);
    EXPECT_EQ(image.non_finite, 0u);
    for (int channel = 0; channel < 3; ++channel) {
      const Estimate seen = mean_of(image, channel);
      const double exact = scattered_once(fog, kLamp, channel);
      EXPECT_LT(seen.standard_error, 4e-2 * exact);
      EXPECT_NEAR(seen.value, exact, 5 * seen.standard_error + 1e-2 * exact);
    }
  }
}

TEST(PhotonsInMedia, PpmMatchesCausticInManyScatterings) {
  const TestScene scene = mirror_scene({.scattering = {0.3, 0.5, 0.1}, .anisotropy = 0.3});
  const HalfImages caustic = scene.render({"caustic:photons=30000", 34, 0}, 8),
                   ppm = scene.render({"ppm:photons=50000", 35, 0}, 6);
  for (int channel = 0; channel < 3; ++channel) {
    const Estimate a = mean_of(caustic, channel), b = mean_of(ppm, channel);
    const double error = std::hypot(a.standard_error, b.standard_error);
    EXPECT_LT(error, 4e-2 * a.value);
    EXPECT_NEAR(a.value, b.value, 5 * error + 1e-2 * a.value);
  }
}

// A sun shines straight down on a deep block of milky glass, and the camera looks straight down. With three scatterings,
// light is refracted, scattered once in the glass, and refracted. With transmittance t at the surface, index n and
// extinction σ its radiance is E · (t/n)² · scattering · phase · ∫ exp(−2σz) dz.
class MilkyGlass : public ::testing::TestWithParam<std::string> {};
INSTANTIATE_TEST_SUITE_P(By, MilkyGlass, ::testing::Values("caustic", "ppm"),
                         [](const auto& info) { return info.param; });

TEST_P(MilkyGlass, ScattersTheSunOnceBehindItsSurface) {
  const Medium milk{.scattering = {0.5, 1, 0.2}, .absorption = {0.1, 0, 0.3}, .anisotropy = -0.3};
  const double index = 1.5, reflected = std::pow((index - 1) / (index + 1), 2), depth = 40;
  const auto scene = TestScene::from_text(
      document(R"("eye": [0.3, 30, 0.2], "look_at": [0.3, 0, 0.2], "up": [0, 0, 1])", 2, 8, milk.text("milk", index),
               mesh("milk", "block.obj"),
               fmt::format(R"({{"directional": {{"direction": [0, -1, 0], "irradiance": {}}}}})", gray(2))),
      {{"block.obj", box(-8, 9, -depth, 0, -7, 8)}});
  const HalfImages image = scene.render({GetParam() + ":photons=40000", 36, 3}, 7);
  EXPECT_EQ(image.non_finite, 0u);
  for (int channel = 0; channel < 3; ++channel) {
    const double sigma = milk.extinction()[channel];
    const double exact = 2 * std::pow((1 - reflected) / index, 2) * milk.scattering[channel] *
                         phase(milk.anisotropy, -1) * (1 - std::exp(-2 * sigma * depth)) / (2 * sigma);
    const Estimate seen = mean_of(image, channel);
    EXPECT_LT(seen.standard_error, 3e-2 * exact);
    EXPECT_NEAR(seen.value, exact, 5 * seen.standard_error + 2e-2 * exact) << channel;
  }
  EXPECT_EQ(mean_of(scene.render({"path", 37, 3}, 4), 0).value, 0) << "no path from the camera finds it";
}

// With one bounce, photons bring what comes by way of the mirror. `path` finds the rest.
TEST(PhotonsInMedia, MetersReadWhatFogLetsPass) {
  const double sigma = 0.4, height = 0.6;
  const std::string parts = fmt::format(
      R"("materials": [{{"name": "mirror", "mirror": {{}}}}, {}], "objects": [{}, {}],
         "lights": [{{"point": {{"position": [0, 1, 0], "intensity": {}}}}}],
         "meters": [{{"name": "patch", "patch": {{"corner": [1, {}, -0.05], "edge1": [0, 0, 0.1], "edge2": [0, 0.1, 0]}}}}])",
      Medium{.scattering = Vec3d(sigma)}.text("fog", 1), plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]"),
      sphere("fog", "[0, 0, 0]", 9), gray(1), height - 0.05);
  const double distance = std::hypot(1, 1 + height), mirrored = std::exp(-sigma * distance) / std::pow(distance, 3);
  const auto read = [&](const std::string& method, std::uint32_t level) {
    return read_meters(scene_with(parts), level, 1, nullptr, method, 1)[0];
  };
  const MeterReading path = read("path", 7), reading = read("caustic:photons=50000", 6);
  const double error = std::hypot(reading.half_width, path.half_width) / 1.96;
  EXPECT_LT(error, 0.08 * mirrored);
  EXPECT_NEAR(reading.value - path.value, mirrored, 4.5 * error);
}

// Scenes of other programs have rooms whose only boundary of the fog is their open side.
TEST(PhotonsInMedia, ARoomWithAWindowToItsFogIsFullOfIt) {
  const auto room = [](const std::string& fog) {
    const std::string side = "v -2.5 -1.5 -1\nv 2.5 -1.5 -1\nv 2.5 3.5 -1\nv -2.5 3.5 -1\nf 1 2 3 4\n";
    const std::string walls =
        "v -2 -1 -1\nv -2 3 -1\nv -2 3 -6\nv -2 -1 -6\nv 2 -1 -1\nv 2 3 -1\nv 2 3 -6\nv 2 -1 -6\n"
        "f 1 2 3 4\nf 5 6 7 8\nf 2 3 7 6\nf 3 4 8 7\n";
    return TestScene::from_text(
        document(R"("eye": [0, 1, 3], "look_at": [0, 1, -3])", 40, 16,
                 R"({"name": "mirror", "mirror": {}})" + also(diffuse("wall", 0)) +
                     also(Medium{.scattering = {0.1, 0.2, 0.3}}.text("fog", 1)),
                 mesh("mirror", "floor.obj") + also(mesh("wall", "walls.obj")) + also(mesh("fog", fog)),
                 fmt::format(R"({{"point": {{"position": [0.5, 2, -3], "intensity": {}}}}})", gray(1))),
        {{"floor.obj", horizontal_rectangle(-2, 2, -6, -1, -1, true)},
         {"walls.obj", walls},
         {"window.obj", side},
         {"closed.obj", box(-2.5, 2.5, -1.5, 3.5, -6.5, -1)}});
  };
  const HalfImages closed = photon_light(room("closed.obj"), "caustic:photons=30000", 0, 5),
                   open = photon_light(room("window.obj"), "caustic:photons=30000", 0, 5);
  for (int channel = 0; channel < 3; ++channel) {
    const Estimate a = mean_of(closed, channel), b = mean_of(open, channel);
    const double error = std::hypot(a.standard_error, b.standard_error);
    EXPECT_LT(error, 2e-2 * a.value);
    EXPECT_NEAR(a.value, b.value, 5 * error);
  }
}

TEST(PhotonsInMedia, ACropHasTheBitsOfTheFilm) {
  for (const std::string method : {"caustic", "ppm"}) {
    const TestScene scene = mirror_scene(kFogs[1], 32);
    const HalfImages film = scene.render({method, 38, 0}, 3);
    const PixelRect crop{5, 3, 13, 11};
    const HalfImages part = scene.render({method, 38, 0}, 3, crop);
    for (int y = 0; y < crop.height; ++y) {
      for (int x = 0; x < 3 * crop.width; ++x) {
        ASSERT_EQ(part.a[static_cast<std::size_t>(y * 3 * crop.width + x)],
                  film.a[static_cast<std::size_t>((y + crop.y) * 3 * film.width + 3 * crop.x + x)]);
      }
    }
  }
}

}  // namespace
}  // namespace lightmill::test

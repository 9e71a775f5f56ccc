// Light that fog scatters once, against quadrature in double precision along the line of sight: few and many lights,
// cones, coloured and nested media, and lights that both techniques find.
#include <cmath>
#include <numbers>

#include "tests/analytic/scene_text.h"

namespace lightmill::test {
namespace {

/// A ball of fog. All values are per channel.
struct Fog {
  Vec3d center{0};
  double radius = 60;
  Vec3d scattering{0}, absorption{0};
  double anisotropy = 0;
  Vec3d extinction() const { return scattering + absorption; }
};

struct Lamp {
  Vec3d position;
  Vec3d intensity{1};
  Vec3d axis{0, -1, 0};
  double cutoff_degrees = 180;  ///< half the angle of a spot
};

/// Henyey and Greenstein's function of the cosine between the directions before and after.
double henyey_greenstein(double g, double cosine) {
  return (1 - g * g) / (4 * std::numbers::pi * std::pow(1 + g * g - 2 * g * cosine, 1.5));
}

/// Length of the part of a segment in a ball.
double length_inside(const Fog& ball, const Vec3d& from, const Vec3d& to) {
  const double length = glm::length(to - from);
  const Vec3d direction = (to - from) / length, out = from - ball.center;
  const double b = glm::dot(out, direction), c = glm::dot(out, out) - ball.radius * ball.radius, root2 = b * b - c;
  if (root2 <= 0) {
    return 0;
  }
  return std::max(std::min(-b + std::sqrt(root2), length) - std::max(-b - std::sqrt(root2), 0.0), 0.0);
}

/// Fogs in each other, the outermost first. All points lie in the outermost.
double optical_depth(const std::vector<Fog>& fogs, const Vec3d& from, const Vec3d& to, int channel) {
  double depth = 0, inner = 0;
  for (auto fog = fogs.rbegin(); fog != fogs.rend(); ++fog) {
    const double inside = length_inside(*fog, from, to);
    depth += fog->extinction()[channel] * (inside - inner);
    inner = inside;
  }
  return depth;
}

/// The direction of sight is −z, from the origin to the edge of the outermost fog.
Vec3d sight(double distance) {
  return {0, 0, -distance};
}

/// Density of scattered light per length, over I/d² of a light that shines from `wi`.
double scattered(const std::vector<Fog>& fogs, double distance, const Vec3d& wi, int channel) {
  const Vec3d point = sight(distance);
  const Fog* here = nullptr;
  for (const Fog& fog : fogs) {
    if (glm::length(point - fog.center) < fog.radius) {
      here = &fog;
    }
  }
  // Light travels along −wi, then back to the camera along +z.
  return here->scattering[channel] * henyey_greenstein(here->anisotropy, -wi.z) *
         std::exp(-optical_depth(fogs, Vec3d(0), point, channel));
}

/// Midpoint rule. Steps grow with the distance, because the integrands do not change fast far away.
template <class Integrand>
double along_sight(double end, int steps, const Integrand& integrand) {
  double sum = 0;
  for (int i = 0; i < steps; ++i) {
    const double u = (i + 0.5) / steps;
    sum += 2 * u * end / steps * integrand(end * u * u);
  }
  return sum;
}

double seen(const std::vector<Fog>& fogs, const std::vector<Lamp>& lamps, int channel) {
  return along_sight(fogs[0].radius, 200'000, [&](double distance) {
    double sum = 0;
    for (const Lamp& lamp : lamps) {
      const Vec3d to_lamp = lamp.position - sight(distance);
      const double d = glm::length(to_lamp);
      const Vec3d wi = to_lamp / d;
      if (-glm::dot(wi, lamp.axis) < std::cos(lamp.cutoff_degrees * std::numbers::pi / 180)) {
        continue;
      }
      sum += lamp.intensity[channel] / (d * d) * scattered(fogs, distance, wi, channel) *
             std::exp(-optical_depth(fogs, sight(distance), lamp.position, channel));
    }
    return sum;
  });
}

std::string list(const Vec3d& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}
std::string rgb(const Vec3d& v) {
  return fmt::format(R"({{"rgb": {}}})", list(v));
}

std::string text_of(const Lamp& lamp) {
  return lamp.cutoff_degrees < 180
             ? fmt::format(R"({{"spot": {{"position": {}, "direction": {}, "intensity": {}, "cutoff_degrees": {}}}}})",
                           list(lamp.position), list(lamp.axis), rgb(lamp.intensity), lamp.cutoff_degrees)
             : fmt::format(R"({{"point": {{"position": {}, "intensity": {}}}}})", list(lamp.position),
                           rgb(lamp.intensity));
}

TestScene fog_scene(const std::vector<Fog>& fogs, const std::string& lights, const std::string& materials = "",
                    const std::string& objects = "", double fov_degrees = 0.01, int size = 8) {
  std::string all_materials = materials, all_objects = objects;
  for (std::size_t i = 0; i < fogs.size(); ++i) {
    const Fog& fog = fogs[i];
    const std::string separator = all_materials.empty() ? "" : ", ";
    all_materials += separator + fmt::format(R"({{"name": "fog{}", "dielectric": {{"ior": 1}}, "interior": {{
        "scattering": {}, "absorption": {}, "anisotropy": {}}}}})",
                                             i, rgb(fog.scattering), rgb(fog.absorption), fog.anisotropy);
    all_objects += separator + sphere(fmt::format("fog{}", i), list(fog.center), fog.radius);
  }
  return TestScene::from_text(
      document(R"("eye": [0, 0, 0], "look_at": [0, 0, -1])", fov_degrees, size, all_materials, all_objects, lights));
}

std::string text_of(const std::vector<Lamp>& lamps) {
  std::string text;
  for (const Lamp& lamp : lamps) {
    text += (text.empty() ? "" : ", ") + text_of(lamp);
  }
  return text;
}

void expect_seen(const std::vector<Fog>& fogs, const std::vector<Lamp>& lamps, std::uint32_t level, double error) {
  const TestScene scene = fog_scene(fogs, text_of(lamps));
  const HalfImages image = scene.render({"path", 62, 1}, level);
  EXPECT_EQ(image.non_finite, 0u);
  for (int channel = 0; channel < 3; ++channel) {
    expect_answer(mean_of(image, channel), seen(fogs, lamps, channel), error);
  }
}

/// So thin that light is scattered to the eye from one of 20,000 lines of sight.
TEST(SingleScattering, ThinFogAroundALightHasNoMoreNoiseThanThickFog) {
  const double scattering = 1e-6, h = 0.05, ahead = 2, inner = std::atan2(ahead, h), outer = std::atan2(60 - ahead, h);
  const std::vector<Fog> fogs{{.scattering = Vec3d(scattering)}};
  const std::vector<Lamp> lamps{{.position = {0, h, -ahead}}};
  const double exact = scattering / (4 * std::numbers::pi) * (inner + outer) / h;  // without extinction
  EXPECT_NEAR(seen(fogs, lamps, 0), exact, 1e-4 * exact);
  expect_answer(mean_of(fog_scene(fogs, text_of(lamps)).render({"path", 63, 1}, 8), 0), seen(fogs, lamps, 0), 3e-3);
}

TEST(SingleScattering, BeamsOfSpotsMatchTheIntegral) {
  const std::vector<Fog> fogs{{.scattering = {0.1, 0.2, 0.4}, .absorption = {0.05, 0, 0.1}, .anisotropy = 0.4}};
  // Across the line of sight, along it, towards the eye, away from it, and a cone wider than a hemisphere.
  expect_seen(fogs, {{{0.4, 2, -3}, Vec3d(3), glm::normalize(Vec3d(-0.1, -1, 0.1)), 20}}, 11, 1e-2);
  expect_seen(fogs, {{{0, 0.2, -1}, Vec3d(1), glm::normalize(Vec3d(0, -0.1, -1)), 15}}, 11, 1e-2);
  expect_seen(fogs, {{{0.3, 0, -8}, Vec3d(9), glm::normalize(Vec3d(0, 0.02, 1)), 10}}, 11, 1e-2);
  expect_seen(fogs, {{{0, 1, -2}, Vec3d(1), {0, -1, 0}, 120}}, 11, 1e-2);
  expect_seen(fogs, {{{0, 1, -2}, Vec3d(1), glm::normalize(Vec3d(0, 1, -0.2)), 100}}, 12, 1e-2);
}

TEST(SingleScattering, ColouredFogMatchesTheIntegralInEachChannel) {
  // The channels' mean free paths differ by a factor of 100. One is only absorbed.
  for (const double g : {-0.6, 0.0, 0.8}) {
    const std::vector<Fog> fogs{{.scattering = {0.02, 2, 0.3}, .absorption = {0, 0.1, 0.4}, .anisotropy = g}};
    expect_seen(fogs, {{.position = {0, 0.5, -1.5}, .intensity = {1, 2, 0.5}}}, 13, 1e-2);
  }
  const std::vector<Fog> fogs{{.scattering = {0, 0.5, 0.5}, .absorption = {1, 0, 0}}};
  const TestScene scene = fog_scene(fogs, text_of({{.position = {0, 0.5, -1.5}}}));
  const HalfImages image = scene.render({"path", 64, 1}, 11);
  EXPECT_EQ(mean_of(image, 0).value, 0);
  expect_answer(mean_of(image, 1), seen(fogs, {{.position = {0, 0.5, -1.5}}}, 1), 1e-2);
}

std::vector<Lamp> lamps_in_a_row(int count) {
  std::vector<Lamp> lamps;
  for (int i = 0; i < count; ++i) {
    const double share = (i + 0.5) / count;
    lamps.push_back({.position = {0.3 + 0.2 * (i % 3), i % 2 == 0 ? 0.4 : -0.7, -8 * share},
                     .intensity = {1 + share, 1.5 - share, 0.3}});
    if (i % 4 == 3) {
      lamps.back().axis = glm::normalize(Vec3d(-0.5, -lamps.back().position.y, -0.2));
      lamps.back().cutoff_degrees = 40;
    }
  }
  return lamps;
}

// Up to four lights are all sampled. Up to 16 are chosen one by one, and more in clusters.
TEST(SingleScattering, AnyNumberOfLightsMatchesTheIntegral) {
  const std::vector<Fog> fogs{{.scattering = {0.2, 0.1, 0.3}, .absorption = {0, 0.05, 0.1}, .anisotropy = 0.3}};
  for (const int count : {2, 4, 5, 16, 40}) {
    expect_seen(fogs, lamps_in_a_row(count), 13, 1e-2);
  }
}

TEST(SingleScattering, NestedFogsMatchTheIntegral) {
  // The line of sight passes two balls in a thin fog. The light is in one of them, or between them.
  const std::vector<Fog> one{{.scattering = {0.05, 0.1, 0.2}, .absorption = {0.02, 0, 0}},
                             {{0.2, 0, -3}, 1.5, {0.6, 0.3, 0.1}, {0, 0.2, 0}, 0.5}};
  expect_seen(one, {{.position = {0, 0.6, -3}}}, 14, 1.5e-2);
  expect_seen(one, {{.position = {0, 0.6, -6}}}, 14, 1.5e-2);
  const std::vector<Fog> two{one[0], one[1], {{0.2, 0, -3}, 0.7, {0, 0.5, 0.3}, {2, 0, 0.1}, -0.3}};
  expect_seen(two, {{.position = {0, 1, -2}}, {.position = {0.2, -0.5, -3}}}, 14, 1.5e-2);
}

/// Radiance that a ball with radiance 1 scatters to the eye. The ball is seen in a cone about the direction to its
/// centre.
double seen_from_ball(const Fog& fog, const Vec3d& center, double radius, int channel) {
  return along_sight(fog.radius, 4000, [&](double distance) {
    const Vec3d to_center = center - sight(distance);
    const double d = glm::length(to_center), cos_max = std::sqrt(1 - radius * radius / (d * d));
    const Vec3d axis = to_center / d;
    const Vec3d side = glm::normalize(glm::cross(axis, Vec3d(0.3, 0.5, 0.8))), other = glm::cross(axis, side);
    constexpr int kSteps = 16;
    double sum = 0;
    for (int i = 0; i < kSteps; ++i) {
      const double cosine = 1 - (1 - cos_max) * (i + 0.5) / kSteps, sine = std::sqrt(1 - cosine * cosine);
      const double way = d * cosine - std::sqrt(std::max(radius * radius - d * d * sine * sine, 0.0));
      for (int j = 0; j < kSteps; ++j) {
        const double phi = 2 * std::numbers::pi * (j + 0.5) / kSteps;
        const Vec3d wi = axis * cosine + side * (sine * std::cos(phi)) + other * (sine * std::sin(phi));
        sum += scattered({fog}, distance, wi, channel) * std::exp(-fog.extinction()[channel] * way);
      }
    }
    return sum * 2 * std::numbers::pi * (1 - cos_max) / (kSteps * kSteps);
  });
}

// Next-event estimation and the phase function both find these lights.
TEST(SingleScattering, LightsWithASizeAreCountedOnce) {
  const double r = 0.4;
  const Vec3d center{0, 0.6, -1.5};
  const std::string emitter =
      fmt::format(R"({{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {}}})", gray(0), gray(1));
  const std::string sphere_light = fmt::format(R"({{"point": {{"position": {}, "radius": {}, "intensity": {}}}}})",
                                               list(center), r, gray(std::numbers::pi * r * r));
  for (const double g : {0.0, 0.9, -0.5}) {
    const Fog fog{.scattering = {0.1, 1, 0.3}, .absorption = {0, 0.2, 1}, .anisotropy = g};
    const TestScene scenes[] = {fog_scene({fog}, "", emitter, sphere("lamp", list(center), r)),
                                fog_scene({fog}, sphere_light)};
    for (const TestScene& scene : scenes) {
      const HalfImages image = scene.render({"path", 65, 1}, 13);
      for (int channel = 0; channel < 3; ++channel) {
        expect_answer(mean_of(image, channel), seen_from_ball(fog, center, r, channel), 1.5e-2);
      }
    }
  }
}

// Everything has radiance 1: the sky, a ball, and fog that absorbs nothing. Paths in dense fog are far from the ball.
// Thin fog around the ball has next-event estimation with points of its own.
TEST(Scattering, FogBesideALightPassesTheWhiteFurnaceTest) {
  for (const double density : {0.05, 0.7, 25.0}) {
    for (const double away : {1.6, 6.0}) {
      const std::string medium =
          fmt::format(R"({{"name": "fog", "dielectric": {{"ior": 1}}, "interior": {{"scattering": {}}}}})",
                      rgb(density * Vec3d(1, 0.5, 0.1)));
      const TestScene scene = TestScene::from_text(
          document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 40, 16,
                   medium + also(fmt::format(R"({{"name": "lamp", "diffuse": {{"reflectance": {}}}, "emission": {}}})",
                                             gray(0), gray(1))),
                   sphere("fog", "[0, 0, 0]", 1) + also(sphere("lamp", fmt::format("[{}, 0, 0]", away), 0.5)),
                   fmt::format(R"({{"environment": {{"radiance": {}}}}})", gray(1))));
      const HalfImages image = scene.render({"path", 66, 0}, 9);
      EXPECT_EQ(image.non_finite, 0u);
      for (int channel = 0; channel < 3; ++channel) {
        expect_answer(mean_of(image, channel), 1, 1e-2);
      }
    }
  }
}

// Other tiles have other paths in the same eight lanes.
TEST(SingleScattering, ACropHasTheBitsOfTheFilm) {
  const std::vector<Fog> fogs{{.scattering = {0.05, 0.1, 0.2}, .absorption = {0.02, 0, 0}},
                              {{0.2, 0, -3}, 1.5, {6, 3, 1}, {0, 0.2, 0}, 0.5}};
  const TestScene scene = fog_scene(fogs, text_of(lamps_in_a_row(5)), "", "", 40, 32);
  const HalfImages film = scene.render({"path", 67, 0}, 4);
  const PixelRect crop{5, 3, 13, 11};
  const HalfImages part = scene.render({"path", 67, 0}, 4, crop);
  for (int y = 0; y < crop.height; ++y) {
    for (int x = 0; x < 3 * crop.width; ++x) {
      ASSERT_EQ(part.a[static_cast<std::size_t>(y * 3 * crop.width + x)],
                film.a[static_cast<std::size_t>((y + crop.y) * 3 * film.width + 3 * crop.x + x)]);
    }
  }
}

// 400 seeds. The sum of squared errors over their stated variances has the mean 400 and the deviation 29 if errors are
// normal. The threshold is 5 deviations.
TEST(SingleScattering, TheStatedErrorHolds) {
  constexpr int kSeeds = 400;
  const std::vector<Fog> fogs{{.scattering = {0.1, 0.2, 0.4}, .absorption = {0.05, 0, 0.1}, .anisotropy = 0.4}};
  std::vector<Lamp> lamps = lamps_in_a_row(5);
  lamps.push_back({{0.4, 2, -3}, Vec3d(3), glm::normalize(Vec3d(-0.1, -1, 0.1)), 20});
  const TestScene scene = fog_scene(fogs, text_of(lamps));
  const double exact = seen(fogs, lamps, 1);
  double sum = 0;
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    const Estimate estimate = mean_of(scene.render({"path", 1000 + seed, 1}, 6), 1);
    const double z = (estimate.value - exact) / estimate.standard_error;
    sum += z * z;
  }
  EXPECT_NEAR(sum, kSeeds, 5 * std::sqrt(2.0 * kSeeds) + 0.04 * kSeeds);  // variances of 64 pixels add 3 %
}

}  // namespace
}  // namespace lightmill::test

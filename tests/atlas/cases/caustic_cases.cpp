// Light that reaches a surface through mirrors and glass. Paths from the camera find it only by chance, or not at all.
#include "tests/analytic/glass_answers.h"
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/light_over_mirror.h"

namespace lightmill::test {
namespace {

const char* const kDelta = "delta light through glass (A-C)";

/// A: the sun (irradiance π) at normal incidence through a slab of glass onto a floor of albedo ½. The camera is
/// between them.
AtlasCase sun_through_slab(const std::string& name, const std::string& objects,
                           const std::map<std::string, std::string>& files, double tolerance) {
  return {.subject = kDelta,
          .name = name,
          .document = document(
              R"("eye": [0, 0.8, 0.6], "look_at": [0, 0, 0])", 60, 32,
              named("glass", R"("dielectric": {"ior": 1.5})") + also(diffuse("floor", 0.5)), objects,
              fmt::format(R"({{"directional": {{"direction": [0, -1, 0], "irradiance": {}}}}})", gray(kPiDouble))),
          .files = files,
          .exact = 0.5004331,
          .tolerance = tolerance,
          .level = 3};
}

/// C: a point light (I = π) at height 1 over a half-space of glass. Its floor at depth 1 is seen from within. Light
/// that leaves in a ring of directions arrives in a ring of the floor.
AtlasCase point_over_half_space() {
  const double n = 1.5;
  const auto irradiance = [n](double x) {
    const auto reached = [n](double theta) { return std::tan(theta) + std::tan(std::asin(std::sin(theta) / n)); };
    double low = 1e-9, high = 1.5;
    for (int i = 0; i < 60; ++i) {
      (reached((low + high) / 2) < x ? low : high) = (low + high) / 2;
    }
    const double t = std::asin(std::sin(low) / n), step = 1e-5;
    const double slope = (reached(low + step) - reached(low - step)) / (2 * step);
    const double s = std::sin(low - t) / std::sin(low + t), p = std::tan(low - t) / std::tan(low + t);
    return kPiDouble * (1 - (s * s + p * p) / 2) * std::sin(low) / (x * slope);
  };
  const AtlasView view{.eye = {0.1, -0.2, 0.3}, .look_at = {0.5, -1, 0.02}, .fov_degrees = 50};
  const double exact = view.mean_of([&](const Vec3d& way) {
    const Vec3d at = view.eye + way * ((-1 - view.eye.y) / way.y);
    return 0.5 / kPiDouble * irradiance(std::hypot(at.x, at.z));
  });
  return {.subject = kDelta,
          .name = "C: a point over a half-space of glass, its floor seen from within",
          .document = document(
              view.text(), view.fov_degrees, view.size,
              named("glass", R"("dielectric": {"ior": 1.5})") + also(diffuse("floor", 0.5)),
              plane_shape("glass", "[0, 0, 0]", "[0, 1, 0]") + also(plane_shape("floor", "[0, -1, 0]", "[0, 1, 0]")),
              fmt::format(R"({{"point": {{"position": [0, 1, 0], "intensity": {}}}}})", gray(kPiDouble))),
          .exact = exact,
          .max_bounces = 2};
}

/// A mirror over the rectangle [0, ½] × [-½, ½] of the ground. Its caustic on the wall ends at height 1.
AtlasCase edge_of_a_caustic(bool in_a_mirror) {
  LightOverMirror scene{
      .subject = "caustic edge",
      .name = in_a_mirror ? "of what a mirror throws, seen in it" : "of what a mirror throws, seen directly",
      .view = {.eye = {-1, 0.5, 0}, .look_at = {1, 1, 0}, .fov_degrees = 40}};
  if (in_a_mirror) {
    scene.view = {.eye = {-0.4, 1.2, 0}, .look_at = {0.35, 0, 0}, .fov_degrees = 5};
    scene.bounces = 3;
  }
  scene.mirror = mesh("mirror", "mirror.obj");
  scene.files = {{"mirror.obj", horizontal_rectangle(0, 0.5, -0.5, 0.5, 0, true)}};
  scene.reflected = [](const Vec3d& from, const Vec3d& to) {
    const Vec3d at = from + (to - from) * (from.y / (from.y - to.y));  // it crosses the mirror where y is 0
    return at.x > 0 && at.x < 0.5 && std::abs(at.z) < 0.5;
  };
  scene.steps = 2000;
  AtlasCase made = scene.made();
  made.gathered = 0.01;
  return made;
}

/// A low sun of irradiance π over an endless black floor with a smooth clear coat. A white wall covers the view. The
/// light that the coat reflects onto it comes from far away.
AtlasCase low_sun_over_a_coat() {
  const Vec3d travel = glm::normalize(Vec3d(1, -0.1, 0));
  const double of_coat = fresnel(std::acos(-travel.y), 1.5);
  return {
      .subject = "light over planes without end",
      .name = "a low sun, a smooth coat and a wall high above it",
      .document = document(
          R"("eye": [-1, 3, 0], "look_at": [1, 3, 0])", 10, 32,
          diffuse("wall", 1) + also(named("floor", R"("principled": {"base_color": {"rgb": [0, 0, 0]}, "roughness": 1,
                                                          "specular": 0, "coat": 1, "coat_roughness": 0})")),
          mesh("wall", "wall.obj") + also(plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]")),
          fmt::format(R"({{"directional": {{"direction": [1, -0.1, 0], "irradiance": {}}}}})", gray(kPiDouble))),
      .files = {{"wall.obj", polygon({{1, 2.7, 0.3}, {1, 3.3, 0.3}, {1, 3.3, -0.3}, {1, 2.7, -0.3}})}},
      .exact = travel.x * (1 + of_coat),
      .max_bounces = 2};
}

/// Half of what a gather in the mirror collects near the wall's foot lies below it.
AtlasCase corner() {
  AtlasCase made = LightOverMirror{.subject = "perpendicular corner (photon bias)",
                                   .name = "the foot of a wall on a mirror, seen in it",
                                   .view = {.eye = {0, 0.5, 0}, .look_at = {1, -0.035, 0}, .fov_degrees = 3.2},
                                   .bounces = 3}
                       .made();
  made.gathered = 0.02;
  return made;
}

}  // namespace

std::vector<AtlasCase> caustic_cases() {
  const std::string floor = plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]");
  const auto slab_files = [](double low) {
    return std::map<std::string, std::string>{{"slab.obj", box(-30, 30, low, low + 1, -30, 30)}};
  };
  std::vector<AtlasCase> cases;
  cases.push_back(sun_through_slab("A: the sun through a large slab onto a floor",
                                   floor + also(mesh("glass", "slab.obj")), slab_files(1), 6e-3));
  cases.push_back(sun_through_slab("A: the sun through a slab without end, seen from near",
                                   floor + also(plane_shape("glass", "[0, 2, 0]", "[0, 1, 0]")) +
                                       also(plane_shape("glass", "[0, 1, 0]", "[0, -1, 0]")),
                                   {}, 2e-3));
  cases.push_back(LightOverMirror{.subject = kDelta, .name = "B: a point over a mirror, and a wall"}.made());
  cases.push_back(point_over_half_space());
  cases.push_back(LightOverMirror{.subject = "caustic seen in a mirror",
                                  .name = "of a point light",
                                  .view = {.eye = {-1, 0.5, 0}, .look_at = {1, -0.7, 0}},
                                  .bounces = 3}
                      .made());
  cases.push_back(LightOverMirror{.subject = "caustic seen in a mirror",
                                  .name = "of a lamp",
                                  .radius = 0.3,
                                  .view = {.eye = {-1, 0.5, 0.6}, .look_at = {1, -0.7, 0}},
                                  .bounces = 3}
                      .made());
  cases.push_back(edge_of_a_caustic(false));
  cases.push_back(edge_of_a_caustic(true));
  cases.push_back(corner());
  cases.push_back(low_sun_over_a_coat());
  return cases;
}

std::vector<AtlasCase> shrinking_cases() {
  const char* const subject = "area light shrinking to nothing at constant power";
  std::vector<AtlasCase> cases;
  for (const double radius : {0.3, 0.03, 0.01, 1e-3, 1e-5}) {
    AtlasCase made =
        LightOverMirror{
            .subject = subject, .name = fmt::format("a lamp of radius {} over a mirror", radius), .radius = radius}
            .made();
    cases.push_back(std::move(made));
  }
  for (const double radius : {0.3, 1e-3}) {
    cases.push_back(LightOverMirror{.subject = subject,
                                    .name = fmt::format("a lamp of radius {} that glows by a texture", radius),
                                    .radius = radius,
                                    .textured = true}
                        .made());
  }
  cases.push_back(LightOverMirror{
      .subject = subject,
      .name = "a lamp of radius 1e-3 that glows by a texture, and nothing smooth",
      .radius = 1e-3,
      .textured = true,
      .bounces = 1,
      .mirror_material = R"("diffuse": {"reflectance": {"rgb": [0, 0, 0]}})",
      .reflectance = [](double) {
        return 0.0;
      }}.made());
  return cases;
}

}  // namespace lightmill::test

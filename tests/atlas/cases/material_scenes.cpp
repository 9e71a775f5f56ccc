#include "tests/atlas/cases/material_scenes.h"

#include "tests/analytic/materials/published_formulas.h"

namespace lightmill::test {

AtlasCase emitter_in_a_floor(const std::string& kind, double exact) {
  return {.subject = "roughness -> 0, Phong exponent 1e6",
          .name = kind,
          .document = document(R"("eye": [0, 1, 1], "look_at": [0, 0, 0])", 0.01, 8,
                               diffuse("lamp", 0, 1) + "," + named("floor", kind),
                               mesh("floor", "floor.obj") + "," + mesh("lamp", "lamp.obj")),
          .files = {{"floor.obj", plane(20, 0, true)},
                    {"lamp.obj", polygon({{-1, 0.2, -2}, {1, 0.2, -2}, {1, 3.8, -2}, {-1, 3.8, -2}})}},
          .exact = exact,
          .tolerance = 2e-3,
          .level = 5};
}

AtlasCase emitter_over_a_plate(double roughness, double radius, double aside) {
  const Vec3d eye(-1, 1, 0), emitter(1 + aside * radius, 1, 0), wo = glm::normalize(eye);
  const double exact = lit_by_sphere(
      emitter, radius, wo,
      [&](const Vec3d& o, const Vec3d& i) { return conductor_formula(0.2, 3.9, roughness * roughness, o, i); }, 1000);
  return {.subject = "Veach's MIS plates",
          .name = fmt::format("roughness {}, a lamp of radius {}, {} of it aside", roughness, radius, aside),
          .document =
              document(R"("eye": [-1, 1, 0], "look_at": [0, 0, 0])", 1e-3, 8,
                       named("plate", fmt::format(R"("conductor": {{"eta": {}, "k": {}, "roughness": {}}},
                                                  "single_scattering": true)",
                                                  gray(0.2), gray(3.9), roughness)) +
                           also(diffuse("lamp", 0, 1)),
                       mesh("plate", "floor.obj") + also(sphere("lamp", fmt::format("[{}, 1, 0]", emitter.x), radius))),
          .files = {{"floor.obj", plane(20, 0, true)}},
          .exact = exact,
          .max_bounces = 1,
          .level = 5};
}

AtlasCase mirror_corridor(double reflectance, int reflections) {
  return {.subject = "mirror corridor",
          .name = fmt::format("{} reflections of {}", reflections, reflectance),
          .document = document(R"("eye": [0, 0.5, 0], "look_at": [1, 1.5, 0], "up": [0, 0, 1])", 1e-4, 8,
                               named("mirror", fmt::format(R"("mirror": {{"reflectance": {}}})", gray(reflectance))) +
                                   also(diffuse("lamp", 0, 3)),
                               plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]") +
                                   also(plane_shape("mirror", "[0, 1, 0]", "[0, -1, 0]")) +
                                   also(plane_shape("lamp", fmt::format("[{}, 0, 0]", reflections), "[-1, 0, 0]"))),
          .exact = 3 * std::pow(reflectance, reflections),
          .tolerance = 1e-4};
}

std::vector<GlassPair> glass_pairs() {
  const std::string ball = sphere("a", "[0, 0, 0]", 1);
  return {
      {"nested", ball + also(sphere("b", "[0.1, 0, 0.2]", 0.5))},
      {"touching from within", ball + also(sphere("b", "[0.5, 0, 0]", 0.5))},
      {"touching from without", ball + also(sphere("b", "[1.5, 0, 0]", 0.5))},
      {"overlapping", ball + also(sphere("b", "[0.8, 0.3, 0]", 0.5))},
      {"overlapping, of one kind", ball + also(sphere("a", "[0.8, 0.3, 0]", 0.5))},
      {"blocks that overlap by a hair, of one kind", mesh("a", "left.obj") + also(mesh("a", "right.obj"))},
      {"blocks that overlap by a hair", mesh("b", "left.obj") + also(mesh("a", "right.obj"))},
      {"blocks that overlap by a hair, the second ranks higher", mesh("a", "left.obj") + also(mesh("b", "wide.obj"))}};
}

std::map<std::string, std::string> glass_pair_files(double reach) {
  return {{"left.obj", box(-1, reach, -0.5, 0.5, -0.5, 0.5)},
          {"right.obj", box(0, 1, -0.51, 0.51, -0.51, 0.51)},
          {"wide.obj", box(0, 1, -0.8, 0.8, -0.8, 0.8)},
          {"flush.obj", box(0, 1, -0.5, 0.5, -0.5, 0.5)}};
}

AtlasCase light_pipe() {
  const std::string rod =
      "v -0.05 -0.05 -10\nv 0.05 -0.05 -10\nv 0.05 0.05 -10\nv -0.05 0.05 -10\n"
      "v -0.05 -0.05 10\nv 0.05 -0.05 10\nv 0.05 0.05 10\nv -0.05 0.05 10\n"
      "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";
  return {.subject = "light pipe with 100 total reflections",
          .name = "a rod of glass, seen from within",
          .document = document(R"("eye": [0.011, 0.007, -9.9], "look_at": [0.011, 0.587, -8.9])", 5, 8,
                               diffuse("sky", 0, 1) + R"(, {"name": "glass", "dielectric": {"ior": 1.5}})",
                               sphere("sky", "[0, 0, 0]", 40, true) + "," + mesh("glass", "rod.obj")),
          .files = {{"rod.obj", rod}},
          .exact = 2.25,
          .tolerance = 5e-3};
}

AtlasCase ink(const std::string& interior) {
  return {.subject = "absorption without bound",
          .name = interior,
          .document =
              document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 0.01, 8,
                       diffuse("sky", 0, 1) + R"(, {"name": "ink", "dielectric": {}, "interior": {)" + interior + "}}",
                       sphere("sky", "[0, 0, 0]", 20, true) + "," + sphere("ink", "[0, 0, 0]", 1)),
          .exact = 0.04,
          .level = 6};
}

AtlasCase camera_in_glass(double ior) {
  return {.subject = "camera inside glass",
          .name = fmt::format("at the middle of a ball of index {}", ior),
          .document = document(R"("eye": [0, 0, 0], "look_at": [0, 0, -1])", 90, 16,
                               fmt::format(R"({{"name": "glass", "dielectric": {{"ior": {}}}}})", ior),
                               sphere("glass", "[0, 0, 0]", 1), sky(1)),
          .exact = ior * ior};
}

std::string octahedron(const std::function<std::array<double, 3>(const std::array<double, 3>&)>& normal) {
  const std::array<std::array<double, 3>, 6> corners{
      {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}};
  std::string text;
  for (const auto& c : corners) {
    const auto n = normal(c);
    text += fmt::format("v {} {} {}\nvn {} {} {}\n", c[0], c[1], c[2], n[0], n[1], n[2]);
  }
  return text +
         "f 1//1 2//2 3//3\nf 2//2 4//4 3//3\nf 4//4 5//5 3//3\nf 5//5 1//1 3//3\n"
         "f 2//2 1//1 6//6\nf 4//4 2//2 6//6\nf 5//5 4//4 6//6\nf 1//1 5//5 6//6\n";
}

}  // namespace lightmill::test

// Materials of extreme parameters, glass in difficult arrangements, and media.
#include "tests/atlas/cases/light_over_mirror.h"
#include "tests/atlas/cases/material_scenes.h"

namespace lightmill::test {
namespace {

std::string white_metal(double roughness) {
  return fmt::format(R"("conductor": {{"eta": {}, "k": {}, "roughness": {}}})", gray(1), gray(1000), roughness);
}

/// Glass beside a white ball (albedo 1) in a sphere of radiance 1. All of it is invisible, whatever path light takes.
AtlasCase hidden(const std::string& subject, const std::string& name, const std::string& materials,
                 const std::string& objects, const std::map<std::string, std::string>& files) {
  return {.subject = subject,
          .name = name,
          .document = document(
              R"("eye": [0.5, 2, 4], "look_at": [0, -0.4, 0])", 45, 32,
              diffuse("sky", 0, 1) + also(diffuse("white", 1)) + also(materials),
              sphere("sky", "[0, 0, 0]", 20, true) + also(sphere("white", "[0.2, -1.7, 0.1]", 0.65)) + also(objects)),
          .files = files,
          .exact = 1,
          .level = 3};
}

/// A point light over a floor, inside a ball of index 1.
AtlasCase point_in_air() {
  const AtlasView view{.eye = {0, 0.5, 0.01}, .look_at = {0, 0, 0}, .fov_degrees = 60, .size = 16};
  const double exact = view.mean_of([&](const Vec3d& way) {
    const Vec3d at = view.eye + way * (-view.eye.y / way.y);
    return 4 / kPiDouble * 2 / std::pow(4 + at.x * at.x + at.z * at.z, 1.5);
  });
  return {.subject = "IOR = 1",
          .name = "a point light in a ball of air",
          .document = document(view.text(), view.fov_degrees, view.size,
                               diffuse("floor", 1) + also(named("air", R"("dielectric": {"ior": 1})")),
                               plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]") + also(sphere("air", "[0, 2, 0]", 1)),
                               R"({"point": {"position": [0, 2, 0], "intensity": {"rgb": [4, 4, 4]}}})"),
          .exact = exact,
          .max_bounces = 1};
}

/// An emitter over a floor, and an octahedron with vertex normals between them. The floor's normals are tilted. A ray
/// from behind such a normal uses the flat normal. This is not symmetric for light that is followed the other way, so
/// methods may differ by it.
AtlasCase odd_normals(const std::string& kind, const std::string& name) {
  const std::string floor =
      "v -3 0 3\nv 3 0 3\nv 3 0 -3\nv -3 0 -3\nvn 0.3 1 0\nvn -0.2 1 0.3\nvn 0 1 -0.4\nf 1//1 2//2 3//3 4//1\n";
  return {.subject = "shading normal is not the geometric normal",
          .name = name,
          .document = document(R"("eye": [0.5, 2.5, 4], "look_at": [0, 0.6, 0])", 45, 64,
                               diffuse("floor", 0.7) + also(diffuse("lamp", 0, 10)) + also(named("odd", kind)),
                               mesh("floor", "floor.obj") + also(sphere("lamp", "[1, 3, 0.5]", 0.5)) +
                                   also(shape("odd", R"("mesh": {"file": "odd.obj"})",
                                              R"({"scale": [0.8, 0.8, 0.8], "translate": [0, 0.9, 0]})"))),
          .files = {{"floor.obj", floor},
                    {"odd.obj", octahedron([](const std::array<double, 3>& c) {
                       return std::array<double, 3>{c[0] + 0.3 * c[1], c[1] + 0.2 * c[2], c[2] - 0.3 * c[0]};
                     })}},
          .tolerance = 0.02,
          .level = 3};
}

/// An emitter over a floor and before a wall. u of the floor is turned by 29° from x.
AtlasCase directed_floor(const std::string& kind, const std::string& name) {
  const std::string floor =
      "v -3 0 3\nv 3 0 3\nv 3 0 -3\nv -3 0 -3\nvt 0 0\nvt 0.9 -0.5\nvt 1.4 0.4\nvt 0.5 0.9\nf 1/1 2/2 3/3 4/4\n";
  return {.subject = "anisotropy and sheen",
          .name = name,
          .document = document(
              R"("eye": [0.5, 2.5, 4], "look_at": [0, 0.6, 0])", 45, 64,
              diffuse("wall", 0.7) + also(diffuse("lamp", 0, 10)) + also(named("floor", kind)),
              mesh("floor", "floor.obj") + also(mesh("wall", "wall.obj")) + also(sphere("lamp", "[1, 3, 0.5]", 0.5))),
          .files = {{"floor.obj", floor}, {"wall.obj", polygon({{-3, 0, -3}, {3, 0, -3}, {3, 3, -3}, {-3, 3, -3}})}},
          .tolerance = 0.01,
          .level = 3};
}

/// A small emitter in a closed shade, seen from outside. With its share x = (r/R)² of what the shade sees, the radiance
/// is τ L x / (1 − ρ (1 − x)).
AtlasCase lampshade(const std::string& name, bool principled) {
  const double reflected = 0.6, transmitted = 0.35, radius = 0.1, x = radius * radius;
  const std::string kind =
      principled
          ? fmt::format(R"("principled": {{"base_color": {}, "specular": 0, "transmittance": {}}})",
                        gray(reflected / (1 - transmitted)), gray(transmitted))
          : fmt::format(R"("diffuse": {{"reflectance": {}, "transmittance": {}}})", gray(reflected), gray(transmitted));
  return {.subject = "thin sheets",
          .name = name,
          .document = document(R"("eye": [0, 0.5, 4], "look_at": [0, 0, 0])", 20, 32,
                               diffuse("lamp", 0, 100) + also(named("shade", kind)),
                               sphere("lamp", "[0, 0, 0]", radius) + also(sphere("shade", "[0, 0, 0]", 1))),
          .exact = transmitted * 100 * x / (1 - reflected * (1 - x))};
}

std::string mixture(const std::string& first, const std::string& second, double factor) {
  return fmt::format(R"("mixture": {{"first": {{{}}}, "second": {{{}}}, "factor": {}}})", first, second, factor);
}

std::vector<AtlasCase> mixture_cases() {
  const std::string mirror = R"("mirror": {"reflectance": {"rgb": [0.9, 0.9, 0.9]}})",
                    white = R"("diffuse": {"reflectance": {"rgb": [0.8, 0.8, 0.8]}})",
                    black = R"("diffuse": {"reflectance": {"rgb": [0, 0, 0]}})";
  AtlasCase image = LightOverMirror{
      .name = "a point over a mirror that is half black, and a wall",
      .mirror_material = mixture(mirror, black, 0.5),
      .reflectance = [](double) {
        return 0.45;
      }}.made();
  image.tolerance = 2e-3;
  std::vector<AtlasCase> cases{std::move(image)};
  cases.push_back(directed_floor(mixture(mirror, white, 0.5), "a floor that is half mirror and half white"));
  cases.push_back(directed_floor(
      mixture(R"("conductor": {"metal": "gold", "roughness": 0.15, "anisotropy": 0.8})",
              mixture(white, R"("principled": {"roughness": 0.5, "coat": 0.5, "coat_roughness": 0.3})", 0.25), 0.5),
      "a floor of brushed gold, varnish and white"));
  for (AtlasCase& each : cases) {
    each.subject = "mixtures";
  }
  return cases;
}

}  // namespace

std::vector<AtlasCase> glass_cases() {
  std::vector<AtlasCase> cases;
  for (const GlassPair& pair : glass_pairs()) {
    cases.push_back(hidden("nested, touching, overlapping glass", pair.name, kGlassPairMaterials, pair.objects,
                           glass_pair_files(1e-3)));
  }
  cases.push_back(hidden("IOR = 1", "a rough ball of it", named("air", R"("dielectric": {"ior": 1, "roughness": 1})"),
                         sphere("air", "[0, 0, 0]", 1), {}));
  cases.push_back(point_in_air());
  cases.push_back(light_pipe());
  cases.push_back(ink(R"("color": {"rgb": [0, 0, 0]})"));
  cases.push_back(ink(R"("absorption": {"rgb": [1e30, 1e30, 1e30]})"));
  cases.push_back(camera_in_glass(1.5));
  return cases;
}

std::vector<AtlasCase> material_cases() {
  std::vector<AtlasCase> cases;
  for (const double roughness : {0.0, 1e-4, 0.0099, 0.0101, 0.05}) {
    cases.push_back(emitter_in_a_floor(white_metal(roughness), 1));
  }
  for (const double exponent : {1e4, 1e6}) {
    cases.push_back(emitter_in_a_floor(
        fmt::format(R"("phong": {{"specular": {}, "exponent": {}}})", gray(0.8), exponent), 0.8 * std::sqrt(0.5)));
  }
  const char* const subject = cases.front().subject.c_str();
  for (const double roughness : {1e-3, 0.0101, 0.03, 0.06, 0.1}) {
    AtlasCase made = LightOverMirror{.subject = subject,
                                     .name = fmt::format("a point over metal of roughness {}, and a wall", roughness),
                                     .mirror_material = white_metal(roughness)}
                         .made();
    made.tolerance = roughness < 0.1 ? 2e-3 : 1e-2;  // the image is blurred
    cases.push_back(std::move(made));
  }
  for (const double exponent : {1e5, 1e6}) {
    AtlasCase made = LightOverMirror{
        .subject = subject,
        .name = fmt::format("a point over Phong's gloss of exponent {}, and a wall", exponent),
        .mirror_material = fmt::format(R"("phong": {{"specular": {}, "exponent": {}}})", gray(0.8), exponent),
        .reflectance = [](double cosine) {
          return 0.8 * cosine;
        }}.made();
    made.tolerance = 3e-3;
    cases.push_back(std::move(made));
  }
  for (const auto& [roughness, radius] : {std::pair(0.1, 0.02), {0.1, 0.9}, {0.25, 0.1}, {0.5, 0.4}, {0.8, 0.02}}) {
    cases.push_back(emitter_over_a_plate(roughness, radius, 1));
  }
  for (const auto& [reflectance, reflections] : {std::pair(1.0, 120), {0.99, 100}, {0.5, 5}}) {
    cases.push_back(mirror_corridor(reflectance, reflections));
  }
  cases.push_back(odd_normals(R"("mirror": {})", "of a mirror and its floor"));
  cases.push_back(odd_normals(R"("dielectric": {"ior": 1.5})", "of glass and its floor"));
  cases.push_back(odd_normals(R"("conductor": {"metal": "gold", "roughness": 0.25})", "of rough gold and its floor"));
  cases.push_back(directed_floor(R"("conductor": {"metal": "gold", "roughness": 0.4, "anisotropy": 0.8})",
                                 "a floor of brushed gold"));
  cases.push_back(directed_floor(R"("conductor": {"metal": "silver", "roughness": 0.15, "anisotropy": 0.5})",
                                 "a floor of brushed silver that is a caster"));
  cases.push_back(
      directed_floor(R"("principled": {"roughness": 0.5, "coat": 0.5, "coat_roughness": 0.3, "anisotropy": 0.7, )"
                     R"("sheen_color": {"rgb": [1, 1, 1]}, "sheen_roughness": 0.3})",
                     "a floor of varnished velvet"));
  std::ranges::move(mixture_cases(), std::back_inserter(cases));
  cases.push_back(lampshade("a small emitter in a closed lampshade", false));
  cases.push_back(lampshade("a small emitter in a closed principled lampshade", true));
  return cases;
}

}  // namespace lightmill::test

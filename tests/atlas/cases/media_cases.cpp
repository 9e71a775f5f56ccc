// Light in media that scatter: fog, and milky glass.
#include "tests/analytic/scene_text.h"
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {
namespace {

std::string medium(const std::string& name, double ior, double scattering, double absorption = 0,
                   double anisotropy = 0) {
  return fmt::format(
      R"({{"name": "{}", "dielectric": {{"ior": {}}}, "interior": {{"scattering": {}, "absorption": {}, "anisotropy": {}}}}})",
      name, ior, gray(scattering), gray(absorption), anisotropy);
}

std::string bulb(const std::string& position, double intensity) {
  return fmt::format(R"({{"point": {{"position": {}, "intensity": {}}}}})", position, gray(intensity));
}

/// Single scattering behind a refracting plane, in closed form.
AtlasCase sun_on_milky_glass() {
  const double index = 1.5, scattering = 1, absorption = 0.3, sigma = scattering + absorption, depth = 40;
  const double passed = 1 - std::pow((index - 1) / (index + 1), 2);
  return {.subject = "light scattered in glass",
          .name = "the sun on a block of milky glass, scattered once",
          .document = document(
              R"("eye": [0.3, 30, 0.2], "look_at": [0.3, 0, 0.2], "up": [0, 0, 1])", 2, 32,
              medium("milk", index, scattering, absorption), mesh("milk", "block.obj"),
              fmt::format(R"({{"directional": {{"direction": [0, -1, 0], "irradiance": {}}}}})", gray(kPiDouble))),
          .files = {{"block.obj", box(-8, 9, -depth, 0, -7, 8)}},
          .exact = kPiDouble * std::pow(passed / index, 2) * scattering / (4 * kPiDouble) / (2 * sigma),
          .gathered = 0.02,
          .max_bounces = 3};
}

AtlasCase in_fog(const std::string& name, const std::string& materials, const std::string& objects,
                 const std::string& light, const std::map<std::string, std::string>& files = {}) {
  return {.subject = "light in fog",
          .name = name,
          .document = document(R"("eye": [0, 1, 4], "look_at": [0, 0.8, 0])", 40, 32,
                               materials + also(medium("fog", 1, 0.15, 0.02, 0.4)),
                               objects + also(sphere("fog", "[0, 0, 0]", 9)), light),
          .files = files,
          .gathered = 0.03,
          .level = 5,
          .seconds_to_percent = 100};
}

}  // namespace

std::vector<AtlasCase> media_cases() {
  const std::string floor = plane_shape("floor", "[0, 0, 0]", "[0, 1, 0]"), paint = diffuse("floor", 0.6);
  const std::string glass = named("glass", R"("dielectric": {"ior": 1.5})"),
                    mirror = named("mirror", R"("mirror": {})");
  std::vector<AtlasCase> cases;
  cases.push_back(sun_on_milky_glass());
  cases.push_back(in_fog("a bulb over a floor", paint, floor, bulb("[-1, 2, 0.5]", 5)));
  cases.push_back(
      in_fog("a bulb over a mirror", mirror, plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]"), bulb("[-1, 3, 1]", 5)));
  cases.push_back(in_fog("a bulb behind a glass ball, over a floor", paint + also(glass),
                         floor + also(sphere("glass", "[0, 0.9, 0]", 0.5)), bulb("[-1.2, 2.2, 0]", 5)));
  cases.push_back(
      in_fog("a bulb over a ball of milk in a shell of glass", glass + also(medium("milk", 1.33, 3, 0.1, 0.5)),
             sphere("glass", "[0, 0.9, 0]", 0.8) + also(sphere("milk", "[0, 0.9, 0]", 0.7)), bulb("[-1.2, 3, 1]", 5)));
  return cases;
}

}  // namespace lightmill::test

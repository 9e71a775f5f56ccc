// Cameras, textures, and the files in scenes/.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "common/image/exr.h"
#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/atlas_case.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

/// Rows from the top. All texels differ.
std::string numbered_texels(int width, int height) {
  Image image;
  image.display = image.data = {0, 0, width, height};
  std::vector<float> values;
  for (int i = 0; i < width * height; ++i) {
    values.push_back(static_cast<float>(i + 1) / static_cast<float>(width * height + 1));
  }
  for (const char* const name : {"R", "G", "B"}) {
    image.channels.push_back({name, values});
  }
  return *encode_exr(image);
}

/// A floor with u = x and v = -z in [-1, 1]² under a sky of radiance 1. Its mean is that of all texels, ½.
AtlasCase textured_floor(int width, int height, const std::string& filter) {
  return {.subject = "textures 1x1, non-power-of-two, at u = 1 and negative",
          .name = fmt::format("{}x{}, {}", width, height, filter),
          .document = fmt::format(
              R"({{"camera": {{"eye": [0, 1, 0], "look_at": [0, 0, 0], "up": [0, 0, -1], "vertical_fov_degrees": 90}},
                  "film": {{"width": 24, "height": 24, "filter": {{"kind": "BOX", "radius_pixels": 0.5}}}},
                  "textures": [{{"name": "t", "file": "t.exr", "filter": "{}"}}],
                  "materials": [{{"name": "floor", "diffuse": {{"reflectance": {{"texture": "t"}}}}}}],
                  "objects": [{{"material": "floor", "plane": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}}],
                  "lights": [{}]}})",
              filter, sky(1)),
          .files = {{"t.exr", numbered_texels(width, height)}},
          .exact = 0.5,
          .level = 5};
}

/// A white ball of radius 1 and albedo ½ under a sky of radiance 1, seen from just beside its axis.
AtlasCase along_up(double tilt) {
  return {.subject = "camera looking along up",
          .name = fmt::format("{} off it", tilt),
          .document = document(fmt::format(R"("eye": [{}, 5, 0], "look_at": [0, 0, 0])", 5 * tilt), 1, 8,
                               diffuse("white", 0.5), sphere("white", "[0, 0, 0]", 1), sky(1)),
          .exact = 0.5,
          .level = 3};
}

/// Whether all files in the folder models exist that the document names.
bool has_its_models(const std::filesystem::path& path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  const std::string document = text.str();
  for (std::size_t at = 0; (at = document.find("\"models/", at)) != std::string::npos; ++at) {
    const std::string name = document.substr(at + 1, document.find('"', at + 1) - at - 1);
    if (!std::filesystem::exists(path.parent_path() / name)) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::vector<AtlasCase> picture_cases() {
  std::vector<AtlasCase> cases;
  // The sum of all samples of a pixel and seed. The answer is that of a point light in the middle of a diffuse sphere
  // of albedo ½.
  cases.push_back(
      {.subject = "a million samples summed",
       .name = "in a diffuse sphere",
       .document = document(kInside, 60, 1, diffuse("wall", 0.5), sphere("wall", "[0, 0, 0]", 1, true),
                            fmt::format(R"({{"point": {{"position": [0, 0, 0], "intensity": {}}}}})", gray(kPiDouble))),
       .exact = 1,
       .tolerance = 1e-4,
       .level = 20,
       .quick = false});
  for (const auto& [width, height] : {std::pair(1, 1), {3, 5}, {1, 7}}) {
    for (const char* const filter : {"NEAREST", "BILINEAR"}) {
      cases.push_back(textured_floor(width, height, filter));
    }
  }
  AtlasCase refused = along_up(0);
  refused.name = "exactly";
  refused.exact.reset();
  refused.refusal = "camera.up: must not be parallel";
  cases.push_back(std::move(refused));
  cases.push_back(along_up(1e-5));
  return cases;
}

std::vector<AtlasCase> scene_file_cases() {
  const std::filesystem::path folder = source_file("scenes");
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".json" && has_its_models(entry.path())) {
      names.push_back(entry.path().filename().string());
    }
  }
  std::sort(names.begin(), names.end());
  std::vector<AtlasCase> cases;
  for (const std::string& name : names) {
    cases.push_back({.subject = "scenes/", .name = name, .document = name, .gathered = 5e-3, .level = 3});
  }
  return cases;
}

}  // namespace lightmill::test

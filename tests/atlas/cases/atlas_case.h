// A case of the failure atlas: a scene at which renderers fail, and what a right picture of it shows.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "common/film/tile_grid.h"
#include "common/math/vec.h"
#include "tests/support/render_document.h"

namespace lightmill::test {

struct AtlasCase {
  std::string subject{};   ///< the atlas' words: "delta light through glass"
  std::string name{};      ///< which of these; the two together are unique
  std::string document{};  ///< text of a scene document, or, where it ends in ".json", a file in the folder scenes
  std::map<std::string, std::string> files{};  ///< that the document names

  /// Mean of the red channel over `rect`, from a formula; nothing: the methods that find all light are compared with
  /// each other, block by block.
  std::optional<double> exact = std::nullopt;
  double tolerance = 1e-3;         ///< share of the exact value that rounding and what the formula leaves out may take
  double gathered = 0;             ///< the same for gathers within a radius, of methods that do so: their stated bias
  double unit = 0;                 ///< what shares are of where the exact value is 0
  PixelRect rect{};                ///< of the picture; empty: all of it
  std::uint32_t max_bounces = 0;   ///< as methods have it
  std::uint32_t level = 4;         ///< log2 of the samples a pixel and seed
  bool quick = true;               ///< else too long for a test
  std::string long_by{};           ///< a method by which it is, all the same
  double seconds_to_percent = 10;  ///< a right method that needs more CPU time for an error of 1 % is slow

  /// Not empty: a part of the message with which the scene is refused.
  std::string refusal{};
};

/// Cases of one kind. Making them takes time: exact values are integrals.
struct AtlasGroup {
  const char* name;
  std::vector<AtlasCase> (*cases)();

  friend void PrintTo(const AtlasGroup& group, std::ostream* out) { *out << group.name; }
};
std::span<const AtlasGroup> atlas_groups();

std::vector<AtlasCase> caustic_cases();
std::vector<AtlasCase> shrinking_cases();
std::vector<AtlasCase> face_cases();
std::vector<AtlasCase> place_cases();
std::vector<AtlasCase> glass_cases();
std::vector<AtlasCase> material_cases();
std::vector<AtlasCase> light_cases();
std::vector<AtlasCase> picture_cases();
/// The documents in the folder scenes, but for those that name files which are not there (scenes/get-models).
std::vector<AtlasCase> scene_file_cases();

/// Its scene; images need a decoder (common/image/read).
TestScene scene_of(const AtlasCase& what, const CompiledScene::ImageDecoder& images = nullptr);

/// A pinhole camera with a square film of so many pixels on a side, y upwards.
struct AtlasView {
  Vec3d eye, look_at;
  double fov_degrees = 15;
  int size = 32;
  std::string text() const;  ///< its part of a document, without the field of view
  /// Mean over the film of what is seen in a direction (not of unit length), by the midpoint rule of steps².
  double mean_of(const std::function<double(const Vec3d& direction)>& radiance, int steps = 200) const;
};

}  // namespace lightmill::test

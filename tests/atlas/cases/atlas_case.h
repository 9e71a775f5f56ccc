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
  std::string subject{};   ///< a phrase: "delta light through glass"
  std::string name{};      ///< the case within the subject; the two together are unique
  std::string document{};  ///< text of a scene document, or the name of a ".json" file in the folder scenes
  std::map<std::string, std::string> files{};  ///< files that the document names

  /// Mean of the red channel over `rect`, from a formula. Without one, the methods that find all light are compared
  /// with each other, block by block.
  std::optional<double> exact = std::nullopt;
  double tolerance = 1e-3;         ///< for rounding and what the formula leaves out, as a share of the exact value
  double gathered = 0;             ///< the same for methods that gather within a radius: their stated bias
  double unit = 0;                 ///< replaces the exact value in shares where that is 0
  PixelRect rect{};                ///< of the picture; empty: all of it
  std::uint32_t max_bounces = 0;   ///< as in method settings
  std::uint32_t level = 4;         ///< log2 of the samples per pixel and seed
  bool quick = true;               ///< false: too long for a test
  std::string long_by{};           ///< a method that is too long for a test even so
  double seconds_to_percent = 10;  ///< CPU time for an error of 1 % above which a right method is slow

  /// Part of the message that refuses the scene, or empty.
  std::string refusal{};
};

/// Cases of one kind. Creating them takes time, because exact values are integrals.
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
std::vector<AtlasCase> media_cases();
std::vector<AtlasCase> picture_cases();
/// The documents in the folder scenes, without those that name missing files (scenes/get-models).
std::vector<AtlasCase> scene_file_cases();

/// The scene of a case. Images need a decoder (common/image/read).
TestScene scene_of(const AtlasCase& what, const CompiledScene::ImageDecoder& images = nullptr);

/// A pinhole camera with a square film of this many pixels on a side. y is up.
struct AtlasView {
  Vec3d eye, look_at;
  double fov_degrees = 15;
  int size = 32;
  std::string text() const;  ///< camera part of a document, without the field of view
  /// Mean over the film of the radiance seen in a direction (not of unit length), by the midpoint rule with steps²
  /// points.
  double mean_of(const std::function<double(const Vec3d& direction)>& radiance, int steps = 200) const;
};

}  // namespace lightmill::test

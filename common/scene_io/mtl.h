// Reader of Wavefront MTL. It converts materials to those of the renderer, with notices for unsupported parts.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "common/base/status.h"
#include "common/scene/document.h"
#include "common/scene_io/faults.h"

namespace lightmill {

/// The image of a map_… statement, and its supported options. Coordinates are scaled, then shifted.
struct MtlMap {
  std::string keyword;  ///< in the format's spelling, as "map_Kd"
  std::string file;     ///< as written, relative to the MTL file
  std::array<double, 2> scale{1, 1}, offset{0, 0};
  bool clamp = false;
  char channel = 0;  ///< of a scalar map: r, g, b, m (alpha), l (luminance); 0 if it is not given
  double bump = 1;   ///< -bm
  int line = 0;      ///< of the statement, for messages

  /// Whether both mean the same. The line is ignored.
  friend bool operator==(const MtlMap& a, const MtlMap& b) {
    const auto meaning = [](const MtlMap& m) {
      return std::tie(m.keyword, m.file, m.scale, m.offset, m.clamp, m.channel, m.bump);
    };
    return meaning(a) == meaning(b);
  }
};

/// A part of a material that is not supported.
struct MtlUnused {
  std::string what;  ///< a keyword or an option of a map
  int line = 0;      ///< of the statement, for messages

  /// Whether both are the same. The line is ignored.
  friend bool operator==(const MtlUnused& a, const MtlUnused& b) { return a.what == b.what; }
};
inline constexpr std::size_t kMaxMtlUnused = 64;  ///< parts of a material that are named

/// A material as in the file. Absent values are empty.
struct MtlMaterial {
  std::string name;
  std::string file;  ///< that defines it, for messages
  int line = 0;
  std::optional<RgbColor> ka, kd, ks, ke, tf;
  std::optional<double> ior;                   ///< Ni
  std::optional<double> exponent;              ///< Ns
  std::optional<double> opacity;               ///< d, else 1 − Tr
  std::optional<double> roughness, metallic;   ///< Pr, Pm
  std::optional<double> coat, coat_roughness;  ///< Pc, Pcr
  std::optional<int> illum;
  std::vector<MtlMap> maps;                       ///< the last one of each keyword
  std::vector<MtlUnused> unused;                  ///< each thing once, by line
  std::map<std::string, int, std::less<>> lines;  ///< of the last Kd, Ks, Tf, d (or Tr), illum …, for messages
  int line_of(std::string_view keyword) const;    ///< the material's own line if it has no such statement
  const MtlMap* map(std::string_view keyword) const;
};

/// Reads an MTL file. A name may be defined several times. A wrong statement is skipped and added to the faults:
/// "box.mtl:12: what is wrong, what is expected".
std::vector<MtlMaterial> read_mtl(std::string_view text, const std::string& file_name, Faults& faults);

/// The path of a map's file, relative to its MTL file.
std::string map_path(const MtlMaterial& material, const MtlMap& map);

/// The meaning of Ka: emission, or the ambient light of other programs (ignored). `automatic` looks at the materials.
/// Ka is emission only if some have a Ka that is not black, some do not, and none has a Ke that is not black.
enum class KaMeaning { automatic, emission, ambient };

/// Converts the materials that are rendered together into the scene's. Emission is two-sided. Ke has priority over Ka.
/// The kind follows from illum:
/// - none, 0, 1: diffuse with Kd (grey 0.5 if absent; black if absent on an emitter)
/// - 2: Phong with Kd, Ks and Ns. Both colours are scaled if together they exceed 1.
/// - 3: mirror with Ks (white if absent or black)
/// - 4: glass with Ni (1.5 if absent)
/// - 5 to 9: as the most similar of these, with a notice
/// - 10: shadow catcher
/// - 11: metal with Ks or Kd at normal incidence, with a roughness from Ns
/// - 12: glass that absorbs 1/Kd − 1
/// - 13, 14: glass, or a medium without a surface, that absorbs 1/Kd − 1 and scatters Ks, with a notice
/// - others: diffuse, with a notice
/// With Pr or Pm: principled, whatever illum is. It transmits if illum means glass (4).
///
/// The opacity is d (else 1 − Tr) times map_d. Materials that light enters have none. map_d is the alpha channel if it
/// is the file of map_Kd, else the luminance. If no material is visible at all, d is left out with a notice, because
/// some programs write it the other way round.
///
/// norm is a normal map, and map_Bump and bump are heights times -bm. A bump map whose name says so is read as a normal
/// map, because programs write these there.
///
/// Maps multiply their colour, which is white if absent. They become textures whose `file` is a path and whose asset is
/// not set. Colours above 1 are cut, with a notice. An assumption about Ka is a notice. A part that is left out of
/// several materials is one notice, with the first place and their number. The names differ: callers keep the first
/// material of each name.
void map_materials(const std::vector<MtlMaterial>& materials, KaMeaning ka, Scene& scene,
                   std::vector<std::string>& notices);

}  // namespace lightmill

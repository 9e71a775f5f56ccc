// Wavefront MTL: materials, mapped to what the renderer has, with a notice for all that is left out.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "common/base/status.h"
#include "common/scene/document.h"

namespace lightmill {

/// An image that a map_… statement names, and what of its options is rendered. Coordinates are scaled, then shifted.
struct MtlMap {
  std::string keyword;  ///< as the format spells it, as in "map_Kd"
  std::string file;     ///< as written, relative to the MTL file
  std::array<double, 2> scale{1, 1}, offset{0, 0};
  bool clamp = false;
  char channel = 'l';  ///< of a scalar map: r, g, b, m (alpha), l (luminance)
  int line = 0;        ///< of the statement, for messages

  /// Whether they mean the same, wherever they stand.
  friend bool operator==(const MtlMap& a, const MtlMap& b) {
    const auto meaning = [](const MtlMap& m) {
      return std::tie(m.keyword, m.file, m.scale, m.offset, m.clamp, m.channel);
    };
    return meaning(a) == meaning(b);
  }
};

/// Something that a file says of a material and that is not rendered, or means nothing.
struct MtlUnused {
  std::string what;  ///< a keyword, an option of a map, a number out of range
  int line = 0;      ///< of the statement, for messages

  /// Whether they are the same, wherever they stand.
  friend bool operator==(const MtlUnused& a, const MtlUnused& b) { return a.what == b.what; }
};
inline constexpr std::size_t kMaxMtlUnused = 64;  ///< of a material that are named

/// A material as the file has it; what is absent was not said.
struct MtlMaterial {
  std::string name;
  std::string file;  ///< that defined it, for messages
  int line = 0;
  std::optional<RgbColor> ka, kd, ks, ke, tf;
  std::optional<double> ior;                   ///< Ni
  std::optional<double> exponent;              ///< Ns
  std::optional<double> opacity;               ///< d, or 1 − Tr
  std::optional<double> roughness, metallic;   ///< Pr, Pm
  std::optional<double> coat, coat_roughness;  ///< Pc, Pcr
  std::optional<int> illum;
  std::vector<MtlMap> maps;                       ///< of one keyword the last
  std::vector<MtlUnused> unused;                  ///< each thing once, by line
  std::map<std::string, int, std::less<>> lines;  ///< of the last Kd, Ks, Tf, d (or Tr), illum …, for messages
  int line_of(std::string_view keyword) const;    ///< the material's own if it has no such statement
  const MtlMap* map(std::string_view keyword) const;
};

/// Reads an MTL file; a name may be defined several times. Errors read "box.mtl:12: what is wrong, what is expected".
Result<std::vector<MtlMaterial>> read_mtl(std::string_view text, const std::string& file_name);

/// The path of a map's file: beside the MTL file that names it.
std::string map_path(const MtlMaterial& material, const MtlMap& map);

/// How Ka is read: as emission, as the ambient light that other programs mean (ignored), or by looking at the
/// materials: Ka emits only where some have one that is not black, some do not, and no Ke that is not black appears.
enum class KaMeaning { automatic, emission, ambient };

/// Maps the materials that are rendered together into the scene's. Emission is two-sided; Ke wins over Ka. illum 0, 1
/// or none: diffuse with Kd (grey .5 if absent; black if absent on a lamp); 2: Phong with Kd, Ks and Ns, both colours
/// scaled where they exceed 1 together; 3: mirror with Ks (white if absent or black); 4: glass with Ni (1.5 if absent);
/// 11: metal with Ks or Kd at normal incidence, rough by Ns; 12: glass that absorbs 1/Kd − 1; 5 to 9 as the one of
/// these that is alike, with a notice; all others: diffuse, with a notice. Where Pr or Pm is given: principled,
/// whatever illum says but for glass. Maps multiply their colour, which is white if absent; they become textures whose
/// `file` is a path and whose asset is not set. Colours above 1 are cut, with a notice. What was assumed of Ka is a
/// notice too. What is left out of several materials is one notice, with the first place and their number. The names
/// differ: of several materials of one name callers keep the first.
void map_materials(const std::vector<MtlMaterial>& materials, KaMeaning ka, Scene& scene,
                   std::vector<std::string>& notices);

}  // namespace lightmill

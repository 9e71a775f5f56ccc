#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <tuple>

#include "common/base/text.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/mtl.h"

namespace lightmill {
namespace {

bool is_lit(const std::optional<RgbColor>& color) {
  return color && *color != RgbColor{};
}

std::string_view illum_name(int illum) {
  switch (illum) {
    case 2:
      return " (highlight)";
    case 3:
      return " (mirror)";
    case 4:
      return " (glass)";
    default:
      return "";
  }
}

/// Whether Ka means emission. Adds a notice of what was assumed in doubtful cases.
bool ka_emits(const std::vector<MtlMaterial>& materials, KaMeaning meaning, std::vector<std::string>& notices) {
  const auto lit_ka = [](const MtlMaterial& m) { return is_lit(m.ka); };
  const auto lit_ke = [](const MtlMaterial& m) { return is_lit(m.ke); };
  if (meaning == KaMeaning::emission || std::none_of(materials.begin(), materials.end(), lit_ka)) {
    return meaning == KaMeaning::emission;
  }
  if (meaning == KaMeaning::ambient) {
    notices.emplace_back("Ka was read as ambient light and left out, as requested");
    return false;
  }
  if (std::any_of(materials.begin(), materials.end(), lit_ke)) {
    notices.emplace_back("Ka was read as ambient light and left out, because materials emit by Ke");
    return false;
  }
  if (std::all_of(materials.begin(), materials.end(), lit_ka)) {
    notices.emplace_back("Ka was read as ambient light and left out, because all materials have it");
    return false;
  }
  std::string names;
  for (const MtlMaterial& material : materials) {
    if (is_lit(material.ka)) {
      names += (names.empty() ? "" : ", ") + material.name;
    }
  }
  notices.push_back(fmt::format("Ka was read as emission, because only some materials have it: {}", names));
  return true;
}

/// Whether d and Tr mean the opacity. Adds a notice if not.
bool d_counts(const std::vector<MtlMaterial>& materials, std::vector<std::string>& notices) {
  const auto invisible = [](const MtlMaterial& m) { return m.opacity == 0; };
  if (materials.empty() || !std::all_of(materials.begin(), materials.end(), invisible)) {
    return true;
  }
  notices.emplace_back("d and Tr were left out, because by them all materials would be invisible");
  return false;
}

constexpr std::array<std::string_view, 3> kNormalKeywords{"norm", "map_Bump", "bump"};

/// As in "wall_normal.png", "wall_nrm.png" and "wall_n.png".
bool is_named_normal_map(const std::string& file) {
  std::string stem = std::filesystem::path(file).stem().string();
  std::ranges::transform(stem, stem.begin(), [](unsigned char c) { return std::tolower(c); });
  return stem.find("normal") != std::string::npos || stem.find("nrm") != std::string::npos || stem.ends_with("_n") ||
         stem.ends_with("_nor");
}

/// Converts materials one after the other. Textures are added to the scene's.
class Mapper {
 public:
  Mapper(Scene& scene, bool ka_is_emission, bool d_counts, std::vector<std::string>& notices)
      : scene_(scene), ka_is_emission_(ka_is_emission), d_counts_(d_counts), notices_(notices) {}

  Material map(const MtlMaterial& from) {
    from_ = &from;
    used_.clear();
    Material out;
    out.name = from.name;
    out.emission = emission();
    out.two_sided_emission = out.emission.rgb != RgbColor{};
    set_kind(out);
    set_opacity(out);
    if (!std::holds_alternative<ShadowCatcherMaterial>(out.kind)) {
      set_normals(out);
    }
    say_left_out();
    return out;
  }

  /// Call after the last material.
  void finish_notices() {
    for (const auto& [what, left_out] : left_out_) {
      if (left_out.others > 0) {
        notices_[left_out.notice] = fmt::format("{} and of {} other{}{}", left_out.first, left_out.others,
                                                left_out.others == 1 ? "" : "s", left_out.more);
      }
    }
    if (beyond_ > 0) {
      notices_.push_back(fmt::format("left out: {} more in materials", beyond_));
    }
  }

 private:
  TexturedColor emission() {
    if (is_lit(from_->ke) || (!from_->ke && from_->map("map_Ke") != nullptr)) {
      return {from_->ke.value_or(RgbColor{1, 1, 1}), texture("map_Ke")};
    }
    return ka_is_emission_ && is_lit(from_->ka) ? *from_->ka : RgbColor{};
  }

  void set_kind(Material& out) {
    const int illum = known_illum();
    const bool mapped = illum < 3 && (from_->map("map_Pr") != nullptr || from_->map("map_Pm") != nullptr);
    if (from_->roughness || from_->metallic || mapped) {
      out.kind = principled(out, illum == 4);
      if (from_->roughness.value_or(1) > 0) {
        out.roughness_map = scalar_map("map_Pr");
      }
      out.metallic_map = scalar_map("map_Pm");
    } else if (illum == 2 && is_lit(from_->ks)) {
      out.kind = phong(out);
    } else if (illum == 3) {
      const bool lit = is_lit(from_->ks);
      out.kind = MirrorMaterial{{lit ? cut_to_one("Ks", *from_->ks) : RgbColor{1, 1, 1}, texture("map_Ks")}};
    } else if (illum == 4 || illum == 12) {
      out.kind = DielectricMaterial{from_->ior.value_or(1.5)};
      if (illum == 12) {
        out.interior.absorption = absorption_of_color(cut_to_one("Kd", from_->kd.value_or(RgbColor{1, 1, 1})));
      }
      if (from_->tf && *from_->tf != RgbColor{1, 1, 1}) {
        leave_out("Tf", from_->line_of("Tf"));
      }
    } else if (illum == 10) {
      out.kind = ShadowCatcherMaterial{};
      out.emission = {};
      out.two_sided_emission = false;
    } else if (illum == 13 || illum == 14) {
      scattering(illum, out);
    } else if (illum == 11) {
      out.kind = metal();
    } else {
      out.kind = DiffuseMaterial{diffuse_color(out)};
      if (!from_->illum && is_lit(from_->ks)) {
        leave_out("Ks", from_->line_of("Ks"), ". Without illum it is diffuse, with illum 2 it is glossy");
      }
      if (illum > 4) {
        leave_out(fmt::format("illum {}", illum), from_->line_of("illum"), ". It is rendered as diffuse");
      }
    }
  }

  void set_opacity(Material& out) {
    const MtlMap* map = from_->map("map_d");
    const double value = d_counts_ ? from_->opacity.value_or(1) : 1;
    if (is_boundary(out) || (value == 1 && map == nullptr)) {
      return;
    }
    out.opacity = {Opacity::Mode::blend, value};
    if (map != nullptr) {
      out.opacity.map = scalar_map("map_d");
      const MtlMap* color = from_->map("map_Kd");
      if (map->channel == 0 && color != nullptr && color->file == map->file) {
        out.opacity.map.channel = ScalarMap::Channel::alpha;
      }
    }
  }

  /// These values of illum say that the inside scatters. No keyword says how much.
  void scattering(int illum, Material& out) {
    out.kind = DielectricMaterial{illum == 13 ? from_->ior.value_or(1.5) : 1};
    out.interior.absorption = absorption_of_color(cut_to_one("Kd", from_->kd.value_or(RgbColor{1, 1, 1})));
    out.interior.scattering = from_->ks.value_or(RgbColor{1, 1, 1});
    notices_.push_back(fmt::format(
        "{}:{}: illum {} of material \"{}\" was read as {} that absorbs 1/Kd - 1 and scatters Ks per unit of "
        "length",
        from_->file, from_->line_of("illum"), illum, from_->name,
        illum == 13 ? "glass" : "a medium without a surface"));
  }

  /// The supported model that is most similar: 5 to 9 are much like 2, 3 and 4.
  int known_illum() {
    const int illum = from_->illum.value_or(1);
    constexpr std::array<int, 5> kAlike{3, 4, 4, 2, 4};
    if (illum < 5 || illum > 9) {
      return illum;
    }
    const int alike = kAlike[static_cast<std::size_t>(illum - 5)];
    notices_.push_back(fmt::format("{}:{}: illum {} of material \"{}\" was read as illum {}{}", from_->file,
                                   from_->line_of("illum"), illum, from_->name, alike, illum_name(alike)));
    return alike;
  }

  PhongMaterial phong(const Material& out) {
    PhongMaterial kind;
    kind.diffuse = diffuse_color(out);
    kind.specular = {cut_to_one("Ks", *from_->ks), texture("map_Ks")};
    kind.exponent = std::min(from_->exponent.value_or(kind.exponent), kMaxPhongExponent);
    RgbColor &d = kind.diffuse.rgb, &s = kind.specular.rgb;
    const float most = std::max({d.r + s.r, d.g + s.g, d.b + s.b});
    if (most > 1) {
      // Slightly less than 1, because the sums are rounded.
      const float scale = (1 - 1e-6f) / most;
      d = {d.r * scale, d.g * scale, d.b * scale};
      s = {s.r * scale, s.g * scale, s.b * scale};
      notices_.push_back(
          fmt::format("{}:{}: Kd + Ks of material \"{}\" is above 1, and both were scaled down: a surface cannot "
                      "reflect more than it gets",
                      from_->file, from_->line_of("Ks"), from_->name));
    }
    return kind;
  }

  PrincipledMaterial principled(const Material& out, bool transmits) {
    PrincipledMaterial kind;
    kind.base_color = diffuse_color(out);
    // A map without a number counts with factor 1.
    kind.metallic = from_->metallic.value_or(from_->map("map_Pm") != nullptr ? 1 : 0);
    kind.roughness = from_->roughness.value_or(from_->map("map_Pr") != nullptr ? 1 : kind.roughness);
    kind.transmission = transmits ? 1 : 0;
    kind.ior = from_->ior.value_or(kind.ior);
    kind.coat = from_->coat.value_or(0);
    kind.coat_roughness = from_->coat_roughness.value_or(kind.coat_roughness);
    return kind;
  }

  /// A metal that reflects Ks, else Kd, else white at normal incidence. Ns is a Phong exponent s, similar to GGX with
  /// alpha² = 2 / (s + 2) (Walter et al. 2007). Smooth without Ns.
  PrincipledMaterial metal() {
    PrincipledMaterial kind;
    const bool specular = is_lit(from_->ks);
    const RgbColor color = specular ? *from_->ks : is_lit(from_->kd) ? *from_->kd : RgbColor{1, 1, 1};
    kind.base_color = {cut_to_one(specular ? "Ks" : "Kd", color), texture(specular ? "map_Ks" : "map_Kd")};
    kind.metallic = 1;
    kind.roughness = from_->exponent ? std::sqrt(std::sqrt(2 / (*from_->exponent + 2))) : 0;
    return kind;
  }

  /// Kd with its map. If Kd is absent: black on an emitter, else white under a map, else grey.
  TexturedColor diffuse_color(const Material& out) {
    const std::uint32_t map = texture("map_Kd");
    const float fallback = out.two_sided_emission ? 0 : map == kNoTexture ? 0.5f : 1.0f;
    return {cut_to_one("Kd", from_->kd.value_or(RgbColor{fallback, fallback, fallback})), map};
  }

  RgbColor cut_to_one(std::string_view keyword, const RgbColor& color) {
    if (color.r <= 1 && color.g <= 1 && color.b <= 1) {
      return color;
    }
    notices_.push_back(
        fmt::format("{}:{}: {} of material \"{}\" is above 1 and was cut: a surface cannot reflect more than it gets",
                    from_->file, from_->line_of(keyword), keyword, from_->name));
    return {std::min(color.r, 1.0f), std::min(color.g, 1.0f), std::min(color.b, 1.0f)};
  }

  /// A scalar map, which is data and not a colour.
  ScalarMap scalar_map(std::string_view keyword) {
    const MtlMap* map = from_->map(keyword);
    if (map == nullptr) {
      return {};
    }
    using Channel = ScalarMap::Channel;
    const Channel channel = map->channel == 'r'   ? Channel::r
                            : map->channel == 'g' ? Channel::g
                            : map->channel == 'b' ? Channel::b
                            : map->channel == 'm' ? Channel::alpha
                                                  : Channel::luminance;
    return {texture(keyword, TextureImage::ColorSpace::linear), channel};
  }

  /// Of several maps, the first of these is used.
  void set_normals(Material& out) {
    const auto first =
        std::ranges::find_if(kNormalKeywords, [&](auto keyword) { return from_->map(keyword) != nullptr; });
    if (first == kNormalKeywords.end()) {
      return;
    }
    const MtlMap& map = *from_->map(*first);
    const bool named = is_named_normal_map(map.file);
    if (map.keyword == "norm" || named) {
      out.normal_map = {texture(*first, TextureImage::ColorSpace::linear), map.bump};
    } else {
      out.bump_map = {scalar_map(*first), map.bump};
    }
    if (map.keyword != "norm" && named) {
      notices_.push_back(fmt::format("{}:{}: {} of material \"{}\" was read as a normal map, because of its name",
                                     from_->file, map.line, map.keyword, from_->name));
    }
  }

  /// The texture of a map. kNoTexture if the material has none.
  std::uint32_t texture(std::string_view keyword,
                        TextureImage::ColorSpace color_space = TextureImage::ColorSpace::automatic) {
    const MtlMap* map = from_->map(keyword);
    if (map == nullptr) {
      return kNoTexture;
    }
    used_.emplace_back(keyword);
    TextureImage image;
    image.file = map_path(*from_, *map);
    image.wrap.fill(map->clamp ? TextureImage::Wrap::clamp : TextureImage::Wrap::repeat);
    image.scale = map->scale;
    image.offset = map->offset;
    image.color_space = color_space;
    const auto [known, added] = textures_.try_emplace(
        {image.file, image.wrap, image.scale, image.offset, image.color_space}, scene_.textures.size());
    if (added) {
      image.name = fmt::format("{} ({})", scene_name(map->file), scene_.textures.size());
      scene_.textures.push_back(image);
    }
    return static_cast<std::uint32_t>(known->second);
  }

  void say_left_out() {
    for (const MtlMap& map : from_->maps) {
      if (std::find(used_.begin(), used_.end(), map.keyword) == used_.end()) {
        leave_out(map.keyword, map.line);
      }
    }
    for (const MtlUnused& unused : from_->unused) {
      leave_out(unused.what, unused.line);
    }
  }

  /// Adds to the one notice for all materials, at the place of the first.
  void leave_out(const std::string& what, int line, std::string_view more = "") {
    const auto [found, added] = left_out_.try_emplace(what, LeftOut{notices_.size(), "", std::string(more), 0});
    if (!added) {
      ++found->second.others;
    } else if (left_out_.size() > kMaxLeftOut) {
      left_out_.erase(found);
      ++beyond_;
    } else {
      found->second.first = fmt::format("left out: {}:{}: {} of material \"{}\"", from_->file, line, what, from_->name);
      notices_.push_back(found->second.first + found->second.more);
    }
  }

  static constexpr std::size_t kMaxLeftOut = 100;  ///< parts that are named
  struct LeftOut {
    std::size_t notice;  ///< its index
    std::string first;   ///< begin of its text
    std::string more;    ///< end of its text
    std::size_t others;  ///< materials after the first
  };

  Scene& scene_;
  const bool ka_is_emission_;
  const bool d_counts_;
  std::vector<std::string>& notices_;
  std::map<std::string, LeftOut> left_out_;  ///< by part
  std::size_t beyond_ = 0;                   ///< left out beyond these
  const MtlMaterial* from_ = nullptr;
  std::vector<std::string> used_;  ///< maps of this material that are rendered
  /// Textures by their distinguishing properties.
  std::map<std::tuple<std::string, std::array<TextureImage::Wrap, 2>, std::array<double, 2>, std::array<double, 2>,
                      TextureImage::ColorSpace>,
           std::size_t>
      textures_;
};

}  // namespace

std::string map_path(const MtlMaterial& material, const MtlMap& map) {
  return (std::filesystem::path(material.file).parent_path() / map.file).string();
}

void map_materials(const std::vector<MtlMaterial>& materials, KaMeaning ka, Scene& scene,
                   std::vector<std::string>& notices) {
  Mapper mapper(scene, ka_emits(materials, ka, notices), d_counts(materials, notices), notices);
  for (const MtlMaterial& material : materials) {
    scene.materials.push_back(mapper.map(material));
  }
  mapper.finish_notices();
}

}  // namespace lightmill

#include "common/scene_io/mtl.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "common/scene_io/mtl_map.h"
#include "common/scene_io/text_lines.h"

namespace lightmill {
namespace {

Result<RgbColor> read_color(const StatementReader& lines, std::string_view keyword, std::string_view rest) {
  std::array<float, 3> values{};
  int count = 0;
  for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
    const std::optional<double> value = parse_number(word);
    if (!value || count == 3) {
      return count == 3 ? lines.error("{}: three numbers are expected, got more", keyword)
                        : lines.error("{}: a finite number is expected, got \"{}\"", keyword, word);
    }
    if (*value < 0 || *value > 1e20) {
      return lines.error("{}: numbers from 0 to 1e20 are expected, got {}", keyword, word);
    }
    values[count++] = static_cast<float>(*value);
  }
  if (count == 1) {  // one number is short for a grey
    return RgbColor{values[0], values[0], values[0]};
  }
  if (count != 3) {
    return lines.error("{}: three numbers are expected, got {}", keyword, count);
  }
  return RgbColor{values[0], values[1], values[2]};
}

/// A statement with one number.
struct NumberStatement {
  std::string_view keyword;
  std::optional<double> MtlMaterial::*member;
  double low, high;
};
constexpr std::array<NumberStatement, 6> kNumbers{{{"Ns", &MtlMaterial::exponent, 0, 1e9},
                                                   {"d", &MtlMaterial::opacity, 0, 1},
                                                   {"Pr", &MtlMaterial::roughness, 0, 1},
                                                   {"Pm", &MtlMaterial::metallic, 0, 1},
                                                   {"Pc", &MtlMaterial::coat, 0, 1},
                                                   {"Pcr", &MtlMaterial::coat_roughness, 0, 1}}};

Status read_number(const StatementReader& lines, const Statement& statement, const NumberStatement& kind,
                   std::optional<double>& out) {
  std::string_view rest = statement.rest;
  std::string_view word = take_word(rest);
  if (word == "-halo") {  // d -halo 0.5: thinner where seen head on
    word = take_word(rest);
  }
  const std::optional<double> value = parse_number(word);
  if (!value || *value < kind.low || *value > kind.high) {
    return lines.error("{}: a number from {} to {} is expected, got \"{}\"", kind.keyword, kind.low, kind.high,
                       statement.rest);
  }
  out = value;
  return ok_status();
}

Status read_property(const StatementReader& lines, const Statement& statement, MtlMaterial& material) {
  const std::string_view keyword = statement.keyword;
  const std::array<std::pair<std::string_view, std::optional<RgbColor>*>, 5> colors{
      {{"Ka", &material.ka}, {"Kd", &material.kd}, {"Ks", &material.ks}, {"Ke", &material.ke}, {"Tf", &material.tf}}};
  for (const auto& [name, color] : colors) {
    if (keyword == name) {
      if (statement.rest.starts_with("spectral") || statement.rest.starts_with("xyz")) {
        material.unused.push_back(fmt::format("{} {}", keyword, statement.rest.substr(0, statement.rest.find(' '))));
        return ok_status();
      }
      LM_ASSIGN_OR_RETURN(*color, read_color(lines, keyword, statement.rest));
      return ok_status();
    }
  }
  for (const NumberStatement& kind : kNumbers) {
    if (keyword == kind.keyword) {
      return read_number(lines, statement, kind, material.*kind.member);
    }
  }
  if (keyword == "Tr") {  // 1 − d
    LM_RETURN_IF_ERROR(read_number(lines, statement, {"Tr", nullptr, 0, 1}, material.opacity));
    material.opacity = 1 - *material.opacity;
  } else if (keyword == "Ni") {
    const std::optional<double> ior = parse_number(statement.rest);
    if (!ior || *ior <= 0 || *ior > kMaxIor) {
      return lines.error("Ni: a number in (0, {}] is expected, got \"{}\"", kMaxIor, statement.rest);
    }
    material.ior = ior;
  } else if (keyword == "illum") {
    const std::optional<std::int64_t> illum = parse_integer(statement.rest);
    if (!illum || *illum < 0 || *illum > 1000) {
      return lines.error("illum: the number of an illumination model is expected, got \"{}\"", statement.rest);
    }
    material.illum = static_cast<int>(*illum);
  } else if (is_map(keyword)) {
    return read_map(lines, statement, material);
  }
  // The rest (sharpness, sheen, anisotropy …) is passed over.
  return ok_status();
}

bool is_lit(const std::optional<RgbColor>& color) {
  return color && *color != RgbColor{};
}

RgbColor cut_to_one(const MtlMaterial& material, std::string_view keyword, const RgbColor& color,
                    std::vector<std::string>& notices) {
  if (color.r <= 1 && color.g <= 1 && color.b <= 1) {
    return color;
  }
  notices.push_back(
      fmt::format("{}:{}: {} of material \"{}\" is above 1 and was cut: a surface cannot reflect more than it gets",
                  material.file, material.line, keyword, material.name));
  return {std::min(color.r, 1.0f), std::min(color.g, 1.0f), std::min(color.b, 1.0f)};
}

std::string_view illum_name(int illum) {
  switch (illum) {
    case 10:
      return " (holdout)";
    case 13:
    case 14:
      return " (scattering)";
    default:
      return "";
  }
}

/// Whether Ka means emission, and a notice of what was assumed where it could be doubted.
bool ka_emits(const std::vector<MtlMaterial>& materials, KaMeaning meaning, std::vector<std::string>& notices) {
  const auto lit_ka = [](const MtlMaterial& m) { return is_lit(m.ka); };
  const auto lit_ke = [](const MtlMaterial& m) { return is_lit(m.ke); };
  if (meaning != KaMeaning::automatic || std::none_of(materials.begin(), materials.end(), lit_ka)) {
    return meaning == KaMeaning::emission;
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

RgbColor diffuse_color(const MtlMaterial& material, bool emits, std::vector<std::string>& notices) {
  const RgbColor fallback = emits ? RgbColor{} : RgbColor{0.5f, 0.5f, 0.5f};
  return cut_to_one(material, "Kd", material.kd.value_or(fallback), notices);
}

PhongMaterial phong(const MtlMaterial& material, const RgbColor& kd, std::vector<std::string>& notices) {
  const RgbColor ks = cut_to_one(material, "Ks", *material.ks, notices);
  const float most = std::max({kd.r + ks.r, kd.g + ks.g, kd.b + ks.b});
  const double exponent = std::clamp(material.exponent.value_or(10), 0.0, kMaxPhongExponent);
  if (most <= 1) {
    return {kd, ks, exponent};
  }
  notices.push_back(
      fmt::format("{}:{}: Kd + Ks of material \"{}\" is above 1, both were scaled down by it: a surface cannot reflect "
                  "more than it gets",
                  material.file, material.line, material.name));
  const float scale = 1 / most;
  return {RgbColor{kd.r * scale, kd.g * scale, kd.b * scale}, RgbColor{ks.r * scale, ks.g * scale, ks.b * scale},
          exponent};
}

/// As bright at normal incidence as Ks says, as rough as a lobe of exponent Ns: α² = 2/(Ns + 2) (Walter et al. 2007).
PrincipledMaterial metal(const MtlMaterial& material, std::vector<std::string>& notices) {
  PrincipledMaterial out;
  out.base_color = is_lit(material.ks)   ? cut_to_one(material, "Ks", *material.ks, notices)
                   : is_lit(material.kd) ? cut_to_one(material, "Kd", *material.kd, notices)
                                         : RgbColor{1, 1, 1};
  out.metallic = 1;
  out.roughness = material.exponent ? std::pow(2 / (std::max(*material.exponent, 0.0) + 2), 0.25) : 0;
  return out;
}

void map_kind(const MtlMaterial& material, Material& mapped, std::vector<std::string>& notices) {
  const int illum = material.illum.value_or(1);
  switch (illum) {
    case 3:
      mapped.kind =
          MirrorMaterial{is_lit(material.ks) ? cut_to_one(material, "Ks", *material.ks, notices) : RgbColor{1, 1, 1}};
      return;
    case 4:
      mapped.kind = DielectricMaterial{material.ior.value_or(1.5)};
      return;
    case 11:
      mapped.kind = metal(material, notices);
      return;
    case 12:
      mapped.kind = DielectricMaterial{material.ior.value_or(1.5)};
      mapped.interior.absorption =
          absorption_of_color(cut_to_one(material, "Kd", material.kd.value_or(RgbColor{1, 1, 1}), notices));
      return;
    default:
      break;
  }
  const RgbColor kd = diffuse_color(material, mapped.two_sided_emission, notices);
  if (illum == 2 && is_lit(material.ks)) {
    mapped.kind = phong(material, kd, notices);
    return;
  }
  mapped.kind = DiffuseMaterial{kd};
  if (illum > 4) {
    notices.push_back(fmt::format("left out: {}:{}: illum {}{} of material \"{}\"; it is rendered as diffuse",
                                  material.file, material.line, illum, illum_name(illum), material.name));
  }
}

}  // namespace

const MtlMap* MtlMaterial::map(std::string_view keyword) const {
  const auto found = std::find_if(maps.begin(), maps.end(), [&](const MtlMap& m) { return m.keyword == keyword; });
  return found == maps.end() ? nullptr : &*found;
}

Result<std::vector<MtlMaterial>> read_mtl(std::string_view text, const std::string& file_name) {
  StatementReader lines(text, file_name);
  std::vector<MtlMaterial> materials;
  std::set<std::string, std::less<>> names;
  while (const std::optional<Statement> statement = lines.next()) {
    if (statement->keyword == "newmtl") {
      if (statement->rest.empty()) {
        return lines.error("newmtl: the name of a material is expected");
      }
      if (!names.emplace(utf8_name(statement->rest)).second) {
        return lines.error("newmtl: material \"{}\" is defined twice", statement->rest);
      }
      materials.emplace_back();
      materials.back().name = utf8_name(statement->rest);
      materials.back().file = file_name;
      materials.back().line = statement->line;
    } else if (materials.empty()) {
      return lines.error("newmtl is expected before \"{}\"", statement->keyword.substr(0, 40));
    } else {
      LM_RETURN_IF_ERROR(read_property(lines, *statement, materials.back()));
    }
  }
  return materials;
}

std::vector<Material> map_materials(const std::vector<MtlMaterial>& materials, KaMeaning ka,
                                    std::vector<std::string>& notices) {
  const bool ka_is_emission = ka_emits(materials, ka, notices);
  std::vector<Material> out;
  for (const MtlMaterial& material : materials) {
    Material mapped;
    mapped.name = material.name;
    if (is_lit(material.ke)) {
      mapped.emission = *material.ke;
    } else if (ka_is_emission && is_lit(material.ka)) {
      mapped.emission = *material.ka;
    }
    mapped.two_sided_emission = mapped.emission != RgbColor{};
    map_kind(material, mapped, notices);
    for (const MtlMap& map : material.maps) {
      notices.push_back(fmt::format("left out: {}:{}: {} of material \"{}\"", material.file, material.line, map.keyword,
                                    material.name));
    }
    for (const std::string& keyword : material.unused) {
      notices.push_back(
          fmt::format("left out: {}:{}: {} of material \"{}\"", material.file, material.line, keyword, material.name));
    }
    out.push_back(std::move(mapped));
  }
  return out;
}

}  // namespace lightmill

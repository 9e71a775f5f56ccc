#include "common/scene_io/mtl.h"

#include <algorithm>
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
  if (count == 1) {  // one number is a grey
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

Result<double> read_number(const StatementReader& lines, const Statement& statement, const NumberStatement& kind) {
  std::string_view rest = statement.rest;
  std::string_view word = take_word(rest);
  if (word == "-halo") {  // d -halo 0.5: more transparent when seen at a right angle
    word = take_word(rest);
  }
  const std::optional<double> value = parse_number(word);
  if (!value || *value < kind.low || *value > kind.high) {
    return lines.error("{}: a number from {} to {} is expected, got \"{}\"", kind.keyword, kind.low, kind.high,
                       statement.rest);
  }
  return *value;
}

Status read_property(const StatementReader& lines, const Statement& statement, MtlMaterial& material) {
  const std::string_view keyword = statement.keyword;
  const std::array<std::pair<std::string_view, std::optional<RgbColor>*>, 5> colors{
      {{"Ka", &material.ka}, {"Kd", &material.kd}, {"Ks", &material.ks}, {"Ke", &material.ke}, {"Tf", &material.tf}}};
  for (const auto& [name, color] : colors) {
    if (keyword == name) {
      if (statement.rest.starts_with("spectral") || statement.rest.starts_with("xyz")) {
        material.unused.push_back(
            {fmt::format("{} {}", keyword, statement.rest.substr(0, statement.rest.find(' '))), statement.line});
        return ok_status();
      }
      material.lines.insert_or_assign(std::string(keyword), statement.line);
      LM_ASSIGN_OR_RETURN(*color, read_color(lines, keyword, statement.rest));
      return ok_status();
    }
  }
  for (const NumberStatement& kind : kNumbers) {
    if (keyword == kind.keyword) {
      LM_ASSIGN_OR_RETURN(material.*kind.member, read_number(lines, statement, kind));
      material.lines.insert_or_assign(std::string(keyword), statement.line);
      return ok_status();
    }
  }
  if (keyword == "Tr") {
    LM_ASSIGN_OR_RETURN(const double transparency, read_number(lines, statement, {"Tr", nullptr, 0, 1}));
    if (!material.lines.contains("d")) {  // programs that write both mean d
      material.opacity = 1 - transparency;
      material.lines.insert_or_assign("Tr", statement.line);
    }
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
    material.lines.insert_or_assign("illum", statement.line);
  } else if (is_map(keyword)) {
    return read_map(lines, statement, material);
  } else {  // sharpness, sheen, additions of programs
    material.unused.push_back({std::string(keyword), statement.line});
  }
  return ok_status();
}

/// Of the last statement's unsupported parts, from unused[first] on, keeps those that are new for the material. This
/// limits the memory, whatever the file says.
void keep_new_unused(MtlMaterial& material, std::size_t first, std::set<std::string, std::less<>>& said) {
  std::vector<MtlUnused>& unused = material.unused;
  const std::vector<MtlUnused> added(unused.begin() + static_cast<std::ptrdiff_t>(first), unused.end());
  unused.resize(first);
  for (const MtlUnused& one : added) {
    const std::string what = unused.size() + 1 < kMaxMtlUnused ? utf8_name(one.what.substr(0, 80)) : "more statements";
    if (said.insert(what).second) {
      unused.push_back({what, one.line});
    }
  }
}

}  // namespace

const MtlMap* MtlMaterial::map(std::string_view keyword) const {
  const auto found = std::find_if(maps.begin(), maps.end(), [&](const MtlMap& m) { return m.keyword == keyword; });
  return found == maps.end() ? nullptr : &*found;
}

int MtlMaterial::line_of(std::string_view keyword) const {
  const auto found = lines.find(keyword);
  return found == lines.end() ? line : found->second;
}

std::vector<MtlMaterial> read_mtl(std::string_view text, const std::string& file_name, Faults& faults) {
  StatementReader lines(text, file_name);
  std::vector<MtlMaterial> materials;
  std::set<std::string, std::less<>> said;  ///< unsupported parts of the last material
  while (const std::optional<Statement> statement = lines.next()) {
    Status odd;
    if (statement->keyword == "newmtl") {
      materials.emplace_back();
      materials.back().name = statement->rest.empty() ? "default" : utf8_name(statement->rest);
      materials.back().file = file_name;
      materials.back().line = statement->line;
      said.clear();
      odd = statement->rest.empty() ? lines.error("newmtl: the name of a material is expected") : ok_status();
    } else if (materials.empty()) {
      odd = lines.error("newmtl is expected before \"{}\"", statement->keyword.substr(0, 40));
    } else {
      const std::size_t before = materials.back().unused.size();
      odd = read_property(lines, *statement, materials.back());
      keep_new_unused(materials.back(), before, said);
    }
    if (!odd.ok()) {
      faults.add(fmt::format("mtl {}", statement->keyword.substr(0, 40)), message_of(odd), "the line is skipped");
    }
  }
  return materials;
}

}  // namespace lightmill

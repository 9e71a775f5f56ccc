#include "common/scene_io/mtl.h"

#include <algorithm>
#include <functional>
#include <set>

#include "common/scene_io/assets.h"
#include "common/scene_io/statement_reader.h"

namespace lightmill {
namespace {

// ---- statements that name an image ----

/// The format's spelling of a keyword. Programs differ in upper and lower case.
std::string spelling(std::string_view keyword) {
  const auto equal = [&](std::string_view other) {
    return std::equal(keyword.begin(), keyword.end(), other.begin(), other.end(),
                      [](char a, char b) { return std::tolower(a) == std::tolower(b); });
  };
  for (const std::string_view known : {"map_Ka", "map_Kd", "map_Ks", "map_Ke", "map_Ns", "map_d", "map_Pr", "map_Pm",
                                       "map_Bump", "bump", "disp", "decal", "norm", "refl"}) {
    if (equal(known)) {
      return std::string(known);
    }
  }
  return std::string(keyword);
}

bool is_rendered(std::string_view keyword) {
  return keyword == "map_Kd" || keyword == "map_Ks" || keyword == "map_Ke" || keyword == "map_Pr" ||
         keyword == "map_Pm" || keyword == "map_d" || keyword == "norm" || keyword == "map_Bump" || keyword == "bump";
}

/// Takes up to `most` numbers from the beginning of the text.
std::vector<double> take_numbers(std::string_view& text, std::size_t most) {
  std::vector<double> out;
  while (out.size() < most) {
    std::string_view rest = text;
    const std::optional<double> value = parse_number(take_word(rest));
    if (!value) {
      break;
    }
    out.push_back(*value);
    text = rest;
  }
  return out;
}

/// Options of a map, one at a time.
class MapReader {
 public:
  MapReader(const StatementReader& lines, const Statement& statement, MtlMaterial& material)
      : lines_(lines), rest_(statement.rest), material_(material) {
    map_.keyword = spelling(statement.keyword);
    map_.line = statement.line;
  }

  Status read() {
    // A file name may begin with a minus, too. The name begins with the first word that is no option.
    for (std::string_view after = rest_;; after = rest_) {
      option_ = take_word(after);
      const std::string_view before = rest_;
      rest_ = after;
      LM_ASSIGN_OR_RETURN(const bool known, read_option());
      if (!known) {
        rest_ = before;
        break;
      }
    }
    while (rest_.starts_with(' ') || rest_.starts_with('\t')) {
      rest_.remove_prefix(1);
    }
    if (rest_.empty()) {
      return lines_.error("{}: the name of a file is expected", map_.keyword);
    }
    map_.file = std::string(rest_);
    if (!is_rendered(map_.keyword)) {
      leave_out("");
      return ok_status();
    }
    std::erase_if(material_.maps, [&](const MtlMap& other) { return other.keyword == map_.keyword; });
    material_.maps.push_back(std::move(map_));
    return ok_status();
  }

 private:
  /// Whether the word is an option. If so, takes its arguments.
  Result<bool> read_option() {
    if (option_ == "-s" || option_ == "-o" || option_ == "-t") {
      return read_pair();
    }
    if (option_ == "-clamp") {
      LM_ASSIGN_OR_RETURN(map_.clamp, take_switch());
    } else if (option_ == "-imfchan") {
      const std::string_view channel = take_word(rest_);
      if (channel.size() != 1 || std::string_view("rgbmlz").find(channel[0]) == std::string_view::npos) {
        return lines_.error("{}: -imfchan: one of r, g, b, m, l, z is expected, got \"{}\"", map_.keyword, channel);
      }
      map_.channel = channel[0] == 'z' ? 'l' : channel[0];
    } else if (option_ == "-blendu" || option_ == "-blendv" || option_ == "-cc") {
      LM_RETURN_IF_ERROR(take_switch().status());  // filtering or correction of a texture
    } else if (option_ == "-mm" || option_ == "-boost" || option_ == "-bm" || option_ == "-texres") {
      const std::size_t wanted = option_ == "-mm" ? 2 : 1;
      const std::vector<double> values = take_numbers(rest_, wanted);
      if (values.size() != wanted) {
        return lines_.error("{}: {}: {} numbers are expected, got {}", map_.keyword, option_, wanted, values.size());
      }
      if (option_ == "-bm") {
        if (std::abs(values[0]) > 1e6) {
          return lines_.error("{}: -bm: a number of at most 1e6 is expected, got {}", map_.keyword, values[0]);
        }
        map_.bump = values[0];
      }
      if (option_ == "-mm" && (values[0] != 0 || values[1] != 1)) {
        leave_out(" -mm");
      }
    } else if (option_ == "-type") {
      take_word(rest_);
      leave_out(" -type");
    } else {
      return false;
    }
    return true;
  }

  /// One to three numbers: u, v and w. Missing ones have the default.
  Result<bool> read_pair() {
    const std::vector<double> values = take_numbers(rest_, 3);
    if (values.empty()) {
      return lines_.error("{}: {}: one to three numbers are expected", map_.keyword, option_);
    }
    for (const double value : values) {
      if (std::abs(value) > 1e6) {
        return lines_.error("{}: {}: numbers of at most 1e6 are expected, got {}", map_.keyword, option_, value);
      }
    }
    if (option_ == "-t") {
      leave_out(" -t");
      return true;
    }
    std::array<double, 2>& pair = option_ == "-s" ? map_.scale : map_.offset;
    pair[0] = values[0];
    pair[1] = values.size() > 1 ? values[1] : pair[1];
    return true;
  }

  Result<bool> take_switch() {
    const std::string_view word = take_word(rest_);
    if (word != "on" && word != "off") {
      return lines_.error("{}: {}: on or off is expected, got \"{}\"", map_.keyword, option_, word);
    }
    return word == "on";
  }

  void leave_out(std::string_view more) { material_.unused.push_back({map_.keyword + std::string(more), map_.line}); }

  const StatementReader& lines_;
  std::string_view rest_;
  std::string_view option_;
  MtlMaterial& material_;
  MtlMap map_;
};

bool is_map(std::string_view keyword) {
  const std::string name = spelling(keyword);
  return name.starts_with("map_") || name == "bump" || name == "disp" || name == "decal" || name == "norm" ||
         name == "refl" || name == "aniso" || name == "anisor";
}

/// Reads a statement such as `map_Kd -s 2 2 -clamp on wood grain.png`: options, then a file name that may have blanks.
/// Unsupported options are added to the material's `unused`.
Status read_map(const StatementReader& lines, const Statement& statement, MtlMaterial& material) {
  return MapReader(lines, statement, material).read();
}

// ---- other statements ----

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
    const std::optional<std::int64_t> illum = parse_number<std::int64_t>(statement.rest);
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
    const std::string what = unused.size() + 1 < kMaxMtlUnused ? utf8_text(one.what.substr(0, 80)) : "more statements";
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
      materials.back().name = statement->rest.empty() ? "default" : scene_name(statement->rest);
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

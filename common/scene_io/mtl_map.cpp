#include "common/scene_io/mtl_map.h"

namespace lightmill {
namespace {

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

/// Takes up to `most` numbers from the begin of the text.
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
    // A file name may begin with a minus, too. What is not an option is the name.
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

}  // namespace

bool is_map(std::string_view keyword) {
  const std::string name = spelling(keyword);
  return name.starts_with("map_") || name == "bump" || name == "disp" || name == "decal" || name == "norm" ||
         name == "refl" || name == "aniso" || name == "anisor";
}

Status read_map(const StatementReader& lines, const Statement& statement, MtlMaterial& material) {
  return MapReader(lines, statement, material).read();
}

}  // namespace lightmill

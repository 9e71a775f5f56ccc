#include "common/scene_io/mitsuba/mitsuba_values.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "common/scene_io/statement_reader.h"
#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxDefaults = 1000, kMaxValueBytes = std::size_t{1} << 20;
constexpr std::size_t kMaxSubstitutedBytes = std::size_t{64} << 20, kMaxSubstitutions = 1'000'000;

/// Numbers with blanks, commas or other separators between them.
Result<std::vector<double>> numbers_in(std::string_view text, std::string_view separators, const SourcePlace& place) {
  std::vector<double> out;
  while (true) {
    const std::size_t begin = text.find_first_not_of(separators);
    if (begin == std::string_view::npos) {
      return out;
    }
    const std::size_t end = std::min(text.find_first_of(separators, begin), text.size());
    const std::string_view word = text.substr(begin, end - begin);
    const std::optional<double> value = parse_number(word);
    if (!value) {
      return place.error("a number is expected, got \"{}\"", word);
    }
    out.push_back(*value);
    text.remove_prefix(end);
  }
}

constexpr std::string_view kSeparators = ", \t\r\n";

Result<double> number_in(std::string_view text, const SourcePlace& place) {
  LM_ASSIGN_OR_RETURN(const std::vector<double> all, numbers_in(text, " \t\r\n", place));
  return all.size() == 1 ? Result<double>(all[0]) : place.error("one number is expected, got \"{}\"", text);
}

Result<Point3d> three_in(std::string_view text, const SourcePlace& place) {
  LM_ASSIGN_OR_RETURN(const std::vector<double> all, numbers_in(text, kSeparators, place));
  if (all.size() == 1) {
    return Point3d{all[0], all[0], all[0]};
  }
  return all.size() == 3 ? Result<Point3d>(Point3d{all[0], all[1], all[2]})
                         : place.error("three numbers are expected, got \"{}\"", text);
}

/// The attribute "value", or "x", "y" and "z".
Result<Point3d> point_of(const MitsubaAttributes& given, double fallback, const SourcePlace& place) {
  Point3d out{fallback, fallback, fallback};
  const bool whole = given.contains("value");
  for (std::size_t i = 0; i < 3; ++i) {
    const auto part = given.find(std::string_view("xyz").substr(i, 1));
    if (part == given.end()) {
      continue;
    }
    if (whole) {
      return place.error("value cannot be given together with x, y and z");
    }
    LM_ASSIGN_OR_RETURN(out[i], number_in(part->second, place));
  }
  return whole ? three_in(value_of(given, "value"), place) : Result<Point3d>(out);
}

Result<Transform> matrix_of(const std::vector<double>& m, const SourcePlace& place) {
  if (m.size() != 9 && m.size() != 16) {
    return place.error("a matrix has 9 or 16 numbers, got {}", m.size());
  }
  const std::size_t side = m.size() == 16 ? 4 : 3;
  if (side == 4 && (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1)) {
    return place.error("the matrix must map points without perspective: its last row must be 0, 0, 0, 1");
  }
  Transform out = kIdentityTransform;
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t column = 0; column < side; ++column) {
      out[row][column] = m[side * row + column];
    }
  }
  return out;
}

Result<Transform> look_at_of(const MitsubaAttributes& given, const SourcePlace& place) {
  LM_ASSIGN_OR_RETURN(const Point3d origin, three_in(value_of(given, "origin"), place));
  LM_ASSIGN_OR_RETURN(const Point3d target, three_in(value_of(given, "target"), place));
  Point3d up{0, 0, 0};
  if (given.contains("up")) {
    LM_ASSIGN_OR_RETURN(up, three_in(value_of(given, "up"), place));
  }
  if (up == Point3d{0, 0, 0}) {
    return place.error("lookat: the direction up is missing");
  }
  const std::optional<Transform> out = looking_at(origin, target, up);
  return out ? Result<Transform>(*out)
             : place.error("lookat: the points must differ, and up must not be along the view");
}

bool is_identifier(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

/// In any case.
bool is_word(std::string_view text, std::string_view word) {
  return std::ranges::equal(text, word, {}, [](unsigned char c) { return std::tolower(c); });
}

}  // namespace

std::string value_of(const MitsubaAttributes& given, std::string_view name) {
  const auto found = given.find(name);
  return found == given.end() ? "" : found->second;
}

Status MitsubaDefaults::add(const std::string& name, const std::string& value, const SourcePlace& place) {
  if (name.empty() || values_.size() == kMaxDefaults) {
    return place.error("<default>: a name is expected, and at most {}", kMaxDefaults);
  }
  values_.try_emplace(name, value);
  return ok_status();
}

Result<std::string> MitsubaDefaults::substitute(std::string_view text, const SourcePlace& place) {
  std::string out;
  for (std::size_t at = text.find('$'); at != std::string_view::npos; at = text.find('$')) {
    if (at > 0 && text[at - 1] == '\\') {
      out.append(text.substr(0, at - 1)) += '$';
      text.remove_prefix(at + 1);
      continue;
    }
    out.append(text.substr(0, at));
    text.remove_prefix(at + 1);
    const std::string_view word(text.begin(), std::ranges::find_if_not(text, is_identifier));
    std::size_t length = std::min<std::size_t>(word.size(), 200);
    auto found = values_.end();
    while (length > 0 && (found = values_.find(word.substr(0, length))) == values_.end()) {
      --length;
    }
    if (length == 0) {
      return place.error("there is no default for ${}", word);
    }
    out += found->second;
    text.remove_prefix(length);
    bytes_ += found->second.size();
    if (out.size() > kMaxValueBytes || bytes_ > kMaxSubstitutedBytes || ++steps_ > kMaxSubstitutions) {
      return place.error("the values of defaults make too much text");
    }
  }
  out.append(text);
  return out;
}

Status read_mitsuba_value(const MitsubaAttributes& given, MitsubaParameter& out) {
  const std::string value = value_of(given, "value");
  if (out.type == "string") {
    out.text = value;
    return ok_status();
  }
  if (out.type == "boolean") {
    if (!is_word(value, "true") && !is_word(value, "false")) {
      return out.place.error("true or false is expected, got \"{}\"", value);
    }
    out.numbers = {is_word(value, "true") ? 1.0 : 0.0};
    return ok_status();
  }
  if (out.type == "float" || out.type == "integer") {
    LM_ASSIGN_OR_RETURN(const double number, number_in(value, out.place));
    if (out.type == "integer" && (number != std::floor(number) || std::abs(number) > 0x1p53)) {
      return out.place.error("a whole number is expected, got {}", value);
    }
    out.numbers = {number};
    return ok_status();
  }
  if (out.type == "spectrum") {
    out.text = value_of(given, "filename");
    if (out.text.empty() == value.empty()) {
      return out.place.error("<spectrum>: either a value or a filename is expected");
    }
    LM_ASSIGN_OR_RETURN(out.numbers, numbers_in(value, ":, \t\r\n", out.place));
    return ok_status();
  }
  Point3d three;
  if (out.type == "rgb") {
    LM_ASSIGN_OR_RETURN(three, three_in(value, out.place));
  } else {
    if (!given.contains("value") && !(given.contains("x") && given.contains("y") && given.contains("z"))) {
      return out.place.error("<{}>: x, y and z are expected", out.type);
    }
    LM_ASSIGN_OR_RETURN(three, point_of(given, 0, out.place));
  }
  out.numbers.assign(three.begin(), three.end());
  return ok_status();
}

Result<Transform> read_mitsuba_transform(std::string_view tag, const MitsubaAttributes& given,
                                         const SourcePlace& place) {
  const auto only = [&](std::initializer_list<std::string_view> known) {
    for (const auto& [name, value] : given) {
      if (std::ranges::find(known, name) == known.end()) {
        return place.error("<{}>: unknown attribute \"{}\"", tag, name);
      }
    }
    return ok_status();
  };
  if (tag == "translate" || tag == "scale") {
    LM_RETURN_IF_ERROR(only({"value", "x", "y", "z"}));
    LM_ASSIGN_OR_RETURN(const Point3d by, point_of(given, tag == "scale" ? 1 : 0, place));
    return tag == "scale" ? scaling(by) : translation(by);
  }
  if (tag == "rotate") {
    LM_RETURN_IF_ERROR(only({"value", "x", "y", "z", "angle"}));
    LM_ASSIGN_OR_RETURN(const Point3d axis, point_of(given, 0, place));
    LM_ASSIGN_OR_RETURN(const double degrees, number_in(value_of(given, "angle"), place));
    if (!(length(axis) > 1e-30 && length(axis) < 1e30)) {
      return place.error("the axis of <rotate> must not be zero");
    }
    return rotation(degrees, axis);
  }
  if (tag == "lookat") {
    LM_RETURN_IF_ERROR(only({"origin", "target", "up"}));
    return look_at_of(given, place);
  }
  if (tag == "matrix") {
    LM_RETURN_IF_ERROR(only({"value"}));
    LM_ASSIGN_OR_RETURN(const std::vector<double> all, numbers_in(value_of(given, "value"), kSeparators, place));
    return matrix_of(all, place);
  }
  return place.error("<{}> cannot be read in a transform", tag);
}

}  // namespace lightmill

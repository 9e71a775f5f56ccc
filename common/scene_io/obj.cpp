#include "common/scene_io/obj.h"

#include <cmath>
#include <unordered_map>

#include "common/scene/document.h"
#include "common/scene_io/polygon.h"
#include "common/scene_io/smoothing.h"
#include "common/scene_io/text_lines.h"

namespace lightmill {
namespace {

/// One pass over the file.
class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& file_name) : lines_(text, file_name) {}

  Result<ObjFile> read() {
    while (const std::optional<Statement> statement = lines_.next()) {
      LM_RETURN_IF_ERROR(read_statement(*statement));
    }
    end_smooth_run();
    smooth_normals(file_, smooth_runs_);
    std::erase_if(file_.parts, [](const ObjPart& part) { return part.triangles.empty(); });
    if (file_.parts.empty()) {
      return invalid_argument("{}: the mesh is empty, at least one face (f) is expected", lines_.file_name());
    }
    return std::move(file_);
  }

 private:
  Status read_statement(const Statement& statement) {
    const std::string_view keyword = statement.keyword;
    if (keyword == "v") {
      return read_position(statement.rest);
    }
    if (keyword == "f") {
      return read_face(statement.rest);
    }
    if (keyword == "vn") {
      return read_normal(statement.rest);
    }
    if (keyword == "vt") {
      return read_texture_coordinate(statement.rest);
    }
    if (keyword == "s") {
      return read_smoothing_group(statement.rest);
    }
    if (keyword == "o" || keyword == "g") {
      return ok_status();
    }
    if (keyword == "usemtl") {
      return use_material(statement.rest);
    }
    if (keyword == "mtllib") {
      if (statement.rest.empty()) {
        return lines_.error("mtllib: a file name is expected");
      }
      file_.libraries.push_back({std::string(statement.rest), statement.line});
      return ok_status();
    }
    return pass_over(keyword);
  }

  Status read_position(std::string_view rest) {
    if (file_.positions.size() >= kNoIndex) {
      return lines_.error("v: more than {} vertices", kNoIndex);
    }
    std::array<double, 3> position;
    LM_RETURN_IF_ERROR(read_numbers("v", rest, kMaxCoordinate, position));
    // A weight, or a colour and a weight, may follow. They are skipped.
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      if (!parse_number(word)) {
        return lines_.error("v: a number is expected, got \"{}\"", word);
      }
    }
    file_.positions.push_back(position);
    return ok_status();
  }

  Status read_normal(std::string_view rest) {
    if (file_.normals.size() >= kNoIndex) {
      return lines_.error("vn: more than {} normals", kNoIndex);
    }
    std::array<double, 3> n;
    LM_RETURN_IF_ERROR(read_numbers("vn", rest, kMaxCoordinate, n));
    const double length = std::hypot(n[0], n[1], n[2]);
    if (length > kNoLength) {
      file_.normals.push_back(
          {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)});
    } else {
      file_.normals.push_back({0, 0, 0});
    }
    return ok_status();
  }

  /// u, then v and w if given. w is skipped.
  Status read_texture_coordinate(std::string_view rest) {
    if (file_.texture_coordinates.size() >= kNoIndex) {
      return lines_.error("vt: more than {} texture coordinates", kNoIndex);
    }
    std::array<double, 1> u{}, v{}, w{};
    LM_RETURN_IF_ERROR(read_numbers("vt", rest, kMaxTextureCoordinate, u));
    for (std::array<double, 1>* more : {&v, &w}) {
      if (!rest.empty()) {
        LM_RETURN_IF_ERROR(read_numbers("vt", rest, kMaxTextureCoordinate, *more));
      }
    }
    file_.texture_coordinates.push_back({static_cast<float>(u[0]), static_cast<float>(v[0])});
    return ok_status();
  }

  /// Reads as many finite numbers as `out` holds, none beyond `limit`.
  template <std::size_t count>
  Status read_numbers(std::string_view keyword, std::string_view& rest, double limit, std::array<double, count>& out) {
    for (std::size_t i = 0; i < count; ++i) {
      const std::string_view word = take_word(rest);
      if (word.empty()) {
        return count == 3 ? lines_.error("{}: three numbers are expected, got {}", keyword, i)
                          : lines_.error("{}: a number is expected", keyword);
      }
      const std::optional<double> value = parse_number(word);
      if (!value) {
        return lines_.error("{}: a finite number is expected, got \"{}\"", keyword, word);
      }
      if (std::abs(*value) > limit) {
        return lines_.error("{}: numbers of at most {} are expected, got {}", keyword, limit, word);
      }
      out[i] = *value;
    }
    return ok_status();
  }

  Status read_smoothing_group(std::string_view rest) {
    end_smooth_run();
    if (rest == "off") {
      smooth_run_.group = 0;
      return ok_status();
    }
    const std::optional<std::int64_t> group = parse_integer(rest);
    if (!group || *group < 0) {
      return lines_.error("s: the number of a smoothing group or off is expected, got \"{}\"", rest);
    }
    smooth_run_.group = *group;
    return ok_status();
  }

  /// Stores the run of faces so far if it is in a smoothing group, and begins another.
  void end_smooth_run() {
    const std::size_t count = file_.parts.empty() ? 0 : file_.parts[part_].triangles.size();
    if (smooth_run_.group != 0 && count > smooth_run_.begin) {
      smooth_runs_.push_back({part_, smooth_run_.begin, count, smooth_run_.group});
    }
    smooth_run_.begin = count;
  }

  /// Resolves an index as written (from 1, or negative from the end) among `count` entries.
  Status resolve(std::string_view what, std::string_view word, std::size_t count, std::uint32_t& out) {
    const std::optional<std::int64_t> index = parse_integer(word);
    if (!index) {
      return lines_.error("f: an index is expected, got \"{}\"", word);
    }
    const auto n = static_cast<std::int64_t>(count);
    if (*index == 0 || *index > n || *index < -n) {
      return lines_.error("f: index {} is out of range, there are {} {} so far", *index, n, what);
    }
    out = static_cast<std::uint32_t>(*index > 0 ? *index - 1 : n + *index);
    return ok_status();
  }

  Status read_corner(std::string_view word, ObjCorner& corner) {
    const std::size_t first = word.find('/');
    LM_RETURN_IF_ERROR(resolve("vertices", word.substr(0, first), file_.positions.size(), corner.position));
    if (first == std::string_view::npos) {
      return ok_status();
    }
    const std::string_view tail = word.substr(first + 1);
    const std::size_t second = tail.find('/');
    const std::string_view texture = tail.substr(0, second);
    if (!texture.empty()) {
      LM_RETURN_IF_ERROR(resolve("texture coordinates", texture, file_.texture_coordinates.size(), corner.texture));
    }
    if (second == std::string_view::npos) {
      return texture.empty() ? lines_.error("f: v, v/t, v//n or v/t/n is expected, got \"{}\"", word) : ok_status();
    }
    LM_RETURN_IF_ERROR(resolve("normals", tail.substr(second + 1), file_.normals.size(), corner.normal));
    const std::array<float, 3>& normal = file_.normals[corner.normal];
    if (normal == std::array<float, 3>{0, 0, 0}) {
      corner.normal = kNoIndex;
    }
    return ok_status();
  }

  Status read_face(std::string_view rest) {
    corners_.clear();
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      ObjCorner corner;
      LM_RETURN_IF_ERROR(read_corner(word, corner));
      corners_.push_back(corner);
    }
    if (corners_.size() < 3) {
      return lines_.error("f: at least 3 corners are expected, got {}", corners_.size());
    }
    if (file_.parts.empty()) {
      file_.parts.push_back({"", 0, {}});
    }
    std::vector<ObjTriangle>& triangles = file_.parts[part_].triangles;
    if (corners_.size() == 3) {
      triangles.push_back({corners_[0], corners_[1], corners_[2]});
      return ok_status();
    }
    outline_.clear();
    for (const ObjCorner& corner : corners_) {
      outline_.push_back(file_.positions[corner.position]);
    }
    pieces_.clear();
    if (!triangulate(outline_, pieces_)) {
      say_once(fmt::format("polygons of {} cross themselves, and were cut into fans", lines_.file_name()));
    }
    for (const auto& [a, b, c] : pieces_) {
      triangles.push_back({corners_[a], corners_[b], corners_[c]});
    }
    return ok_status();
  }

  Status use_material(std::string_view written) {
    if (written.empty()) {
      return lines_.error("usemtl: the name of a material is expected");
    }
    end_smooth_run();
    const std::string name = utf8_name(written);
    const auto [found, added] = part_of_.try_emplace(name, file_.parts.size());
    if (added) {
      file_.parts.push_back({name, lines_.line(), {}});
    }
    part_ = found->second;
    smooth_run_.begin = file_.parts[part_].triangles.size();
    return ok_status();
  }

  /// Skips statements of the format that are not supported. Others are errors.
  Status pass_over(std::string_view keyword) {
    for (const std::string_view known :
         {"l",        "p",    "vp",     "cstype", "deg",        "bmat",      "step",  "curv", "curv2", "surf",
          "parm",     "trim", "hole",   "scrv",   "sp",         "end",       "con",   "mg",   "bevel", "c_interp",
          "d_interp", "lod",  "maplib", "usemap", "shadow_obj", "trace_obj", "ctech", "stech"}) {
      if (keyword == known) {
        say_once(fmt::format("left out: \"{}\" statements of {}", keyword, lines_.file_name()));
        return ok_status();
      }
    }
    return lines_.error("unknown statement \"{}\"; v, vt, vn, f, o, g, s, usemtl or mtllib is expected",
                        keyword.substr(0, 40));
  }

  void say_once(std::string notice) {
    if (std::find(file_.notices.begin(), file_.notices.end(), notice) == file_.notices.end()) {
      file_.notices.push_back(std::move(notice));
    }
  }

  StatementReader lines_;
  ObjFile file_;
  std::size_t part_ = 0;  ///< index of the part to which faces are added
  std::unordered_map<std::string, std::size_t> part_of_;
  SmoothRun smooth_run_{};              ///< the faces since the last s or usemtl: their begin and group
  std::vector<SmoothRun> smooth_runs_;  ///< earlier runs in a group
  // The current face:
  std::vector<ObjCorner> corners_;
  std::vector<std::array<double, 3>> outline_;
  std::vector<std::array<std::uint32_t, 3>> pieces_;
};

}  // namespace

Result<ObjFile> read_obj(std::string_view text, const std::string& file_name) {
  return ObjReader(text, file_name).read();
}

}  // namespace lightmill

#include "common/scene_io/obj.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "common/scene/document.h"
#include "common/scene_io/assets.h"
#include "common/scene_io/obj_colors.h"
#include "common/scene_io/polygon.h"
#include "common/scene_io/smoothing.h"
#include "common/scene_io/statement_reader.h"

namespace lightmill {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::array<double, 3> kUnreadable{kNaN, kNaN, kNaN};  ///< position of a vertex that cannot be read

/// One pass over the file. Faces that refer to later entries wait for its end.
class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& file_name, Faults& faults)
      : text_(text), lines_(text, file_name), faults_(faults) {}

  Result<ObjFile> read() {
    while (const std::optional<Statement> statement = lines_.next()) {
      if (const Status odd = read_statement(*statement); !odd.ok()) {
        skip(statement->keyword, odd);
      }
    }
    add_late_faces();
    smooth_normals(file_, smooth_runs_);
    file_.colors = colors_.take_linear(lines_.file_name(), file_.notices);
    if (text_.find("#MRGB ") != std::string_view::npos) {
      say_once(fmt::format("left out: vertex colours in \"#MRGB\" comments of {}", lines_.file_name()));
    }
    std::erase_if(file_.parts, [](const ObjPart& part) { return part.triangles.empty(); });
    if (file_.parts.empty()) {
      return !first_odd_.ok()
                 ? first_odd_
                 : invalid_argument("{}: the mesh is empty, at least one face (f) is expected", lines_.file_name());
    }
    if (!some_face_has_area()) {
      return invalid_argument("{}:{}: f: this face and all others have no area", lines_.file_name(), first_face_line_);
    }
    return std::move(file_);
  }

 private:
  /// A face that refers to later entries of the file.
  struct LateFace {
    std::size_t begin;  ///< in late_corners_
    std::size_t part;
    std::int64_t group;
    int line;
  };

  void skip(std::string_view keyword, const Status& odd) {
    const std::string_view remedy = keyword == "f"        ? "the face is skipped"
                                    : keyword == "v"      ? "the faces there are skipped"
                                    : keyword == "vn"     ? "it is ignored"
                                    : keyword == "vt"     ? "the coordinates count as (0, 0)"
                                    : keyword == "usemtl" ? "the faces are rendered as grey diffuse"
                                                          : "the line is skipped";
    if (first_odd_.ok()) {
      first_odd_ = odd;
    }
    faults_.add(fmt::format("obj {}", keyword.substr(0, 40)), message_of(odd), remedy);
  }

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
    // It counts even if it cannot be read, because faces count the vertices.
    std::array<double, 3>& position = file_.positions.emplace_back(kUnreadable);
    std::array<double, 3> read;
    LM_RETURN_IF_ERROR(read_numbers("v", rest, kMaxCoordinate, read));
    position = read;
    colors_.read(file_.positions.size() - 1, rest);
    return ok_status();
  }

  Status read_normal(std::string_view rest) {
    if (file_.normals.size() >= kNoIndex) {
      return lines_.error("vn: more than {} normals", kNoIndex);
    }
    std::array<float, 3>& normal = file_.normals.emplace_back();
    std::array<double, 3> n;
    LM_RETURN_IF_ERROR(read_numbers("vn", rest, kMaxCoordinate, n));
    const double length = std::hypot(n[0], n[1], n[2]);
    if (!(length > kNoLength)) {
      return lines_.error("vn: a direction is expected, got ({}, {}, {})", n[0], n[1], n[2]);
    }
    normal = {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)};
    return ok_status();
  }

  /// u, then v and w if given. w is skipped.
  Status read_texture_coordinate(std::string_view rest) {
    if (file_.texture_coordinates.size() >= kNoIndex) {
      return lines_.error("vt: more than {} texture coordinates", kNoIndex);
    }
    std::array<float, 2>& coordinates = file_.texture_coordinates.emplace_back();
    std::array<double, 1> u{}, v{}, w{};
    LM_RETURN_IF_ERROR(read_numbers("vt", rest, kMaxTextureCoordinate, u));
    for (std::array<double, 1>* more : {&v, &w}) {
      if (!rest.empty()) {
        LM_RETURN_IF_ERROR(read_numbers("vt", rest, kMaxTextureCoordinate, *more));
      }
    }
    coordinates = {static_cast<float>(u[0]), static_cast<float>(v[0])};
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
    const std::optional<std::int64_t> group = parse_number<std::int64_t>(rest);
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

  /// Resolves an index as written: from 1, or negative from the end of the `count` entries so far. The result can be
  /// beyond these, because entries may follow.
  Status resolve(std::string_view what, std::string_view word, std::size_t count, std::uint32_t& out) const {
    const std::optional<std::int64_t> index = parse_number<std::int64_t>(word);
    if (!index) {
      return lines_.error("f: an index is expected, got \"{}\"", word);
    }
    const auto n = static_cast<std::int64_t>(count);
    if (*index == 0 || *index > kNoIndex || *index < -n) {
      return lines_.error("f: index {} is out of range, there are {} {} so far", *index, n, what);
    }
    out = static_cast<std::uint32_t>(*index > 0 ? *index - 1 : n + *index);
    return ok_status();
  }

  /// Reads v, v/t, v//n or v/t/n. A wrong t or n does not count.
  Status read_corner(std::string_view word, ObjCorner& corner) {
    const std::size_t first = word.find('/');
    LM_RETURN_IF_ERROR(resolve("vertices", word.substr(0, first), file_.positions.size(), corner.position));
    if (first == std::string_view::npos) {
      return ok_status();
    }
    const std::string_view tail = word.substr(first + 1);
    const std::size_t second = tail.find('/');
    const std::string_view texture = tail.substr(0, second);
    const std::string_view normal = second == std::string_view::npos ? "" : tail.substr(second + 1);
    Status odd;
    if (!texture.empty()) {
      odd = resolve("texture coordinates", texture, file_.texture_coordinates.size(), corner.texture);
    }
    if (!normal.empty() && odd.ok()) {
      odd = resolve("normals", normal, file_.normals.size(), corner.normal);
    }
    if (odd.ok() && normal.empty() && (texture.empty() || second != std::string_view::npos)) {
      odd = lines_.error("f: v, v/t, v//n or v/t/n is expected, got \"{}\"", word);
    }
    if (!odd.ok()) {
      faults_.add("obj corner", message_of(odd), "the index is ignored");
    }
    return ok_status();
  }

  Status read_face(std::string_view rest) {
    corners_.clear();
    bool late = false;
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      ObjCorner& corner = corners_.emplace_back();
      LM_RETURN_IF_ERROR(read_corner(word, corner));
      late = late || corner.position >= file_.positions.size() ||
             (corner.texture != kNoIndex && corner.texture >= file_.texture_coordinates.size()) ||
             (corner.normal != kNoIndex && corner.normal >= file_.normals.size());
    }
    if (corners_.size() < 3) {
      return lines_.error("f: at least 3 corners are expected, got {}", corners_.size());
    }
    if (file_.parts.empty()) {
      file_.parts.push_back({"", 0, {}});
    }
    if (late) {
      late_faces_.push_back({late_corners_.size(), part_, smooth_run_.group, lines_.line()});
      late_corners_.insert(late_corners_.end(), corners_.begin(), corners_.end());
      return ok_status();
    }
    return add_face(lines_.line());
  }

  /// Adds the faces that refer to later entries.
  void add_late_faces() {
    for (std::size_t i = 0; i < late_faces_.size(); ++i) {
      const LateFace& face = late_faces_[i];
      if (i == 0 || part_ != face.part || smooth_run_.group != face.group) {
        end_smooth_run();
        part_ = face.part;
        smooth_run_ = {part_, file_.parts[part_].triangles.size(), 0, face.group};
      }
      const std::size_t end = i + 1 < late_faces_.size() ? late_faces_[i + 1].begin : late_corners_.size();
      corners_.assign(late_corners_.begin() + static_cast<std::ptrdiff_t>(face.begin),
                      late_corners_.begin() + static_cast<std::ptrdiff_t>(end));
      if (const Status odd = add_face(face.line); !odd.ok()) {
        skip("f", odd);
      }
    }
    end_smooth_run();
  }

  /// Adds the triangles of a face with these corners_.
  Status add_face(int line) {
    const auto out_of_range = [&](std::uint32_t index, std::size_t count, std::string_view what) {
      return invalid_argument("{}:{}: f: index {} is out of range, there are {} {}", lines_.file_name(), line,
                              std::uint64_t{index} + 1, count, what);
    };
    const auto drop_unless_there = [&](std::uint32_t& index, std::size_t count, std::string_view what) {
      if (index != kNoIndex && index >= count) {
        faults_.add("obj corner", message_of(out_of_range(index, count, what)), "the index is ignored");
        index = kNoIndex;
      }
    };
    for (ObjCorner& corner : corners_) {
      if (corner.position >= file_.positions.size()) {
        return out_of_range(corner.position, file_.positions.size(), "vertices");
      }
      if (std::isnan(file_.positions[corner.position][0])) {
        return invalid_argument("{}:{}: f: vertex {} cannot be read", lines_.file_name(), line,
                                std::uint64_t{corner.position} + 1);
      }
      drop_unless_there(corner.texture, file_.texture_coordinates.size(), "texture coordinates");
      drop_unless_there(corner.normal, file_.normals.size(), "normals");
      if (corner.normal != kNoIndex && file_.normals[corner.normal] == std::array<float, 3>{0, 0, 0}) {
        corner.normal = kNoIndex;
      }
    }
    first_face_line_ = first_face_line_ == 0 ? line : first_face_line_;
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

  bool some_face_has_area() const {
    return std::ranges::any_of(file_.parts, [&](const ObjPart& part) {
      return std::ranges::any_of(part.triangles, [&](const ObjTriangle& t) { return has_area(file_, t); });
    });
  }

  Status use_material(std::string_view written) {
    end_smooth_run();
    const std::string name = scene_name(written);
    const auto [found, added] = part_of_.try_emplace(name, file_.parts.size());
    if (added) {
      file_.parts.push_back({name, lines_.line(), {}});
    }
    part_ = found->second;
    smooth_run_.begin = file_.parts[part_].triangles.size();
    return written.empty() ? lines_.error("usemtl: the name of a material is expected") : ok_status();
  }

  /// Skips statements of the format that are not supported. Others are faults.
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
    return lines_.error("unknown statement \"{}\". Known statements: v, vt, vn, f, o, g, s, usemtl, mtllib",
                        keyword.substr(0, 40));
  }

  void say_once(std::string notice) {
    if (std::find(file_.notices.begin(), file_.notices.end(), notice) == file_.notices.end()) {
      file_.notices.push_back(std::move(notice));
    }
  }

  std::string_view text_;
  StatementReader lines_;
  Faults& faults_;
  Status first_odd_;         ///< the first fault of a statement
  int first_face_line_ = 0;  ///< of those that are not skipped
  ObjFile file_;
  ObjColors colors_;
  std::size_t part_ = 0;  ///< index of the part to which faces are added
  std::unordered_map<std::string, std::size_t> part_of_;
  SmoothRun smooth_run_{};              ///< the faces since the last s or usemtl: first one and group
  std::vector<SmoothRun> smooth_runs_;  ///< earlier runs in a group
  std::vector<LateFace> late_faces_;
  std::vector<ObjCorner> late_corners_;
  // The current face:
  std::vector<ObjCorner> corners_;
  std::vector<std::array<double, 3>> outline_;
  std::vector<std::array<std::uint32_t, 3>> pieces_;
};

}  // namespace

Result<ObjFile> read_obj(std::string_view text, const std::string& file_name, Faults& faults) {
  return ObjReader(text, file_name, faults).read();
}

}  // namespace lightmill

#include "common/scene_io/obj.h"

#include <cmath>
#include <unordered_map>

#include "common/base/check.h"
#include "common/scene/document.h"
#include "common/scene_io/text_lines.h"

namespace lightmill {
namespace {

/// Vectors shorter than this have lost their direction to rounding.
constexpr double kNoLength = 1e-290;

/// One pass over the file.
class ObjReader {
 public:
  ObjReader(std::string_view text, const std::string& file_name) : lines_(text, file_name) {}

  Result<ObjFile> read() {
    while (const std::optional<Statement> statement = lines_.next()) {
      LM_RETURN_IF_ERROR(read_statement(*statement));
    }
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
    if (keyword == "vt" || keyword == "o" || keyword == "g" || keyword == "s") {
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
    if (file_.positions.size() >= kNoNormal) {
      return lines_.error("v: more than {} vertices", kNoNormal);
    }
    std::array<double, 3> position;
    LM_RETURN_IF_ERROR(read_triple("v", rest, position));
    // A weight, or a colour and a weight, may follow: they are read and passed over.
    for (std::string_view word = take_word(rest); !word.empty(); word = take_word(rest)) {
      if (!parse_number(word)) {
        return lines_.error("v: a number is expected, got \"{}\"", word);
      }
    }
    file_.positions.push_back(position);
    return ok_status();
  }

  Status read_normal(std::string_view rest) {
    if (file_.normals.size() >= kNoNormal) {
      return lines_.error("vn: more than {} normals", kNoNormal);
    }
    std::array<double, 3> n;
    LM_RETURN_IF_ERROR(read_triple("vn", rest, n));
    const double length = std::hypot(n[0], n[1], n[2]);
    if (length > kNoLength) {
      file_.normals.push_back(
          {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)});
    } else {
      file_.normals.push_back({0, 0, 0});
    }
    return ok_status();
  }

  Status read_triple(std::string_view keyword, std::string_view& rest, std::array<double, 3>& out) {
    for (int i = 0; i < 3; ++i) {
      const std::string_view word = take_word(rest);
      if (word.empty()) {
        return lines_.error("{}: three numbers are expected, got {}", keyword, i);
      }
      const std::optional<double> value = parse_number(word);
      if (!value) {
        return lines_.error("{}: a finite number is expected, got \"{}\"", keyword, word);
      }
      if (std::abs(*value) > kMaxCoordinate) {
        return lines_.error("{}: numbers of at most {} are expected, got {}", keyword, kMaxCoordinate, word);
      }
      out[i] = *value;
    }
    return ok_status();
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
    if (!texture.empty() && !parse_integer(texture)) {
      return lines_.error("f: an index is expected, got \"{}\"", texture);
    }
    if (second == std::string_view::npos) {
      return texture.empty() ? lines_.error("f: v, v/t, v//n or v/t/n is expected, got \"{}\"", word) : ok_status();
    }
    LM_RETURN_IF_ERROR(resolve("normals", tail.substr(second + 1), file_.normals.size(), corner.normal));
    const std::array<float, 3>& normal = file_.normals[corner.normal];
    if (normal == std::array<float, 3>{0, 0, 0}) {
      corner.normal = kNoNormal;
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
    for (std::size_t i = 2; i < corners_.size(); ++i) {
      triangles.push_back({corners_[0], corners_[i - 1], corners_[i]});
    }
    return ok_status();
  }

  Status use_material(std::string_view written) {
    if (written.empty()) {
      return lines_.error("usemtl: the name of a material is expected");
    }
    const std::string name = utf8_name(written);
    const auto [found, added] = part_of_.try_emplace(name, file_.parts.size());
    if (added) {
      file_.parts.push_back({name, lines_.line(), {}});
    }
    part_ = found->second;
    return ok_status();
  }

  /// Statements of the format that say something we do not render; others are mistakes.
  Status pass_over(std::string_view keyword) {
    for (const std::string_view known :
         {"l",        "p",    "vp",     "cstype", "deg",        "bmat",      "step",  "curv", "curv2", "surf",
          "parm",     "trim", "hole",   "scrv",   "sp",         "end",       "con",   "mg",   "bevel", "c_interp",
          "d_interp", "lod",  "maplib", "usemap", "shadow_obj", "trace_obj", "ctech", "stech"}) {
      if (keyword == known) {
        const std::string notice = fmt::format("left out: \"{}\" statements of {}", keyword, lines_.file_name());
        if (std::find(file_.notices.begin(), file_.notices.end(), notice) == file_.notices.end()) {
          file_.notices.push_back(notice);
        }
        return ok_status();
      }
    }
    return lines_.error("unknown statement \"{}\"; v, vt, vn, f, o, g, s, usemtl or mtllib is expected",
                        keyword.substr(0, 40));
  }

  StatementReader lines_;
  ObjFile file_;
  std::size_t part_ = 0;  ///< index of the part that faces join
  std::unordered_map<std::string, std::size_t> part_of_;
  std::vector<ObjCorner> corners_;  ///< of the face being read
};

using Normal = std::array<float, 3>;

/// The unit normal of a triangle's plane; (0, 0, 1) if it has none.
Normal face_normal(const ObjFile& file, const ObjTriangle& triangle) {
  const auto& a = file.positions[triangle[0].position];
  const auto& b = file.positions[triangle[1].position];
  const auto& c = file.positions[triangle[2].position];
  const std::array<double, 3> u{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
  const std::array<double, 3> v{c[0] - a[0], c[1] - a[1], c[2] - a[2]};
  const std::array<double, 3> n{u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
  const double length = std::hypot(n[0], n[1], n[2]);
  if (!(length > kNoLength)) {
    return {0, 0, 1};
  }
  return {static_cast<float>(n[0] / length), static_cast<float>(n[1] / length), static_cast<float>(n[2] / length)};
}

/// Collects the vertices of a mesh: one for each pair of position and normal, in the order of first use.
class VertexTable {
 public:
  VertexTable(const ObjFile& file, bool smooth, Mesh& mesh) : file_(file), smooth_(smooth), mesh_(mesh) {}

  std::uint32_t vertex(const ObjCorner& corner, const ObjTriangle& triangle) {
    if (smooth_ && corner.normal == kNoNormal) {
      return add(corner, face_normal(file_, triangle));
    }
    const std::uint64_t key = std::uint64_t{corner.position} << 32 | (smooth_ ? corner.normal : 0u);
    const auto [found, added] = index_.try_emplace(key, 0);
    if (added) {
      found->second = add(corner, smooth_ ? file_.normals[corner.normal] : Normal{});
    }
    return found->second;
  }

 private:
  std::uint32_t add(const ObjCorner& corner, const Normal& normal) {
    mesh_.positions.push_back(file_.positions[corner.position]);
    if (smooth_) {
      mesh_.normals.push_back(normal);
    }
    return static_cast<std::uint32_t>(mesh_.positions.size() - 1);
  }

  const ObjFile& file_;
  const bool smooth_;
  Mesh& mesh_;
  std::unordered_map<std::uint64_t, std::uint32_t> index_;
};

}  // namespace

Result<ObjFile> read_obj(std::string_view text, const std::string& file_name) {
  return ObjReader(text, file_name).read();
}

Mesh make_mesh(const ObjFile& file, std::span<const ObjPart* const> parts) {
  bool smooth = false;
  std::size_t count = 0;
  for (const ObjPart* part : parts) {
    count += part->triangles.size();
    for (const ObjTriangle& triangle : part->triangles) {
      for (const ObjCorner& corner : triangle) {
        smooth = smooth || corner.normal != kNoNormal;
      }
    }
  }
  Mesh mesh;
  mesh.triangles.reserve(count);
  VertexTable table(file, smooth, mesh);
  for (const ObjPart* part : parts) {
    for (const ObjTriangle& t : part->triangles) {
      const std::uint32_t a = table.vertex(t[0], t);
      const std::uint32_t b = table.vertex(t[1], t);
      const std::uint32_t c = table.vertex(t[2], t);
      mesh.triangles.push_back({a, b, c});
    }
  }
  return mesh;
}

}  // namespace lightmill

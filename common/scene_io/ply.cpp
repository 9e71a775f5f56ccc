#include "common/scene_io/ply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/base/text.h"
#include "common/materials/texel_values.h"
#include "common/scene_io/polygon.h"
#include "common/scene_io/statement_reader.h"

namespace lightmill {
namespace {

enum class Format { ascii, little, big };
enum class Scalar : std::uint8_t { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::optional<Scalar> scalar_of(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Scalar>, 16> kNames{{{"char", Scalar::int8},
                                                                        {"int8", Scalar::int8},
                                                                        {"uchar", Scalar::uint8},
                                                                        {"uint8", Scalar::uint8},
                                                                        {"short", Scalar::int16},
                                                                        {"int16", Scalar::int16},
                                                                        {"ushort", Scalar::uint16},
                                                                        {"uint16", Scalar::uint16},
                                                                        {"int", Scalar::int32},
                                                                        {"int32", Scalar::int32},
                                                                        {"uint", Scalar::uint32},
                                                                        {"uint32", Scalar::uint32},
                                                                        {"float", Scalar::float32},
                                                                        {"float32", Scalar::float32},
                                                                        {"double", Scalar::float64},
                                                                        {"float64", Scalar::float64}}};
  for (const auto& [known, scalar] : kNames) {
    if (known == name) {
      return scalar;
    }
  }
  return std::nullopt;
}

struct Property {
  std::string name;
  Scalar type = Scalar::float32;
  std::optional<Scalar> list_size;  ///< type of a list's size
};

struct Element {
  std::string name;
  std::uint64_t count = 0;
  std::vector<Property> properties;
};

class PlyReader {
 public:
  PlyReader(std::string_view bytes, const std::string& file_name, std::vector<std::string>* notices)
      : rest_(bytes), file_name_(file_name), notices_(notices) {}

  Result<Mesh> read() {
    LM_RETURN_IF_ERROR(read_header());
    for (const Element& element : elements_) {
      LM_RETURN_IF_ERROR(element.name == "vertex" ? read_vertices(element)
                         : element.name == "face" ? read_faces(element)
                                                  : skip(element));
    }
    LM_RETURN_IF_ERROR(check_indices());
    if (std::ranges::any_of(mesh_.normals, [](const auto& n) { return n == std::array<float, 3>{}; })) {
      mesh_.normals.clear();
    }
    LM_RETURN_IF_ERROR(with_context(validate(mesh_), file_name_));
    return std::move(mesh_);
  }

 private:
  static constexpr int kMaxHeaderLines = 10'000;
  static constexpr std::size_t kMaxProperties = 100, kMaxElements = 100, kMaxCorners = 1'000'000;

  template <class... Args>
  Status error(fmt::format_string<Args...> format, Args&&... args) const {
    return invalid_argument("{}: {}", file_name_, cut_text(fmt::format(format, std::forward<Args>(args)...), 300));
  }

  std::string_view take_line() {
    const std::size_t end = rest_.find('\n');
    std::string_view line = rest_.substr(0, end);
    rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
    ++line_;
    return line;
  }

  Status read_header() {
    std::string_view first = take_line();
    if (take_word(first) != "ply") {
      return error("a PLY file begins with the line \"ply\"");
    }
    bool has_format = false;
    while (!rest_.empty()) {
      std::string_view line = take_line();
      const std::string_view keyword = take_word(line);
      if (line_ > kMaxHeaderLines) {
        return error("the header has more than {} lines", kMaxHeaderLines);
      }
      if (keyword == "end_header") {
        if (unknown_ > 1) {
          notices_->back() += fmt::format(", and {} more such lines", unknown_ - 1);
        }
        return has_format ? ok_status() : error("the header has no format");
      }
      if (keyword == "format") {
        const std::string_view name = take_word(line);
        if (name != "ascii" && name != "binary_little_endian" && name != "binary_big_endian") {
          return error("line {}: unknown format \"{}\"", line_, name);
        }
        format_ = name == "ascii" ? Format::ascii : name == "binary_big_endian" ? Format::big : Format::little;
        has_format = true;
      } else if (keyword == "element") {
        const std::string_view name = take_word(line);
        const std::optional<std::int64_t> count = parse_number<std::int64_t>(take_word(line));
        if (!count || *count < 0 || elements_.size() == kMaxElements) {
          return error("line {}: the number of elements \"{}\" is expected, of at most {} kinds", line_, name,
                       kMaxElements);
        }
        elements_.push_back({std::string(name), static_cast<std::uint64_t>(*count), {}});
      } else if (keyword == "property") {
        LM_RETURN_IF_ERROR(read_property(line));
      } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info" && notices_ != nullptr) {
        if (++unknown_ == 1) {
          notices_->push_back(fmt::format("left out: {}: line {}: unknown keyword \"{}\"", file_name_, line_,
                                          cut_text(printable(keyword), 80)));
        }
      }
    }
    return error("the header has no end_header");
  }

  Status read_property(std::string_view line) {
    if (elements_.empty() || elements_.back().properties.size() == kMaxProperties) {
      return error("line {}: a property must follow an element, which has at most {}", line_, kMaxProperties);
    }
    Property out;
    std::string_view type = take_word(line);
    if (type == "list") {
      out.list_size = scalar_of(take_word(line));
      type = take_word(line);
      if (!out.list_size || *out.list_size >= Scalar::float32) {
        return error("line {}: an integer type is expected for the size of a list", line_);
      }
    }
    const std::optional<Scalar> scalar = scalar_of(type);
    if (!scalar) {
      return error("line {}: unknown type \"{}\"", line_, type);
    }
    out.type = *scalar;
    out.name = take_word(line);
    elements_.back().properties.push_back(std::move(out));
    return ok_status();
  }

  template <class T>
  std::optional<double> take_binary() {
    if (rest_.size() < sizeof(T)) {
      return std::nullopt;
    }
    std::array<char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), rest_.data(), sizeof(T));
    if (format_ == Format::big) {
      std::ranges::reverse(bytes);
    }
    rest_.remove_prefix(sizeof(T));
    return static_cast<double>(std::bit_cast<T>(bytes));
  }

  /// The next value. Nothing at the end, or if it is no number.
  std::optional<double> take(Scalar type) {
    if (format_ == Format::ascii) {
      rest_.remove_prefix(std::min(rest_.find_first_not_of(" \t\r\n"), rest_.size()));
      const std::size_t end = std::min(rest_.find_first_of(" \t\r\n"), rest_.size());
      const std::string_view word = rest_.substr(0, end);
      rest_.remove_prefix(end);
      return parse_number(word);
    }
    switch (type) {
      case Scalar::int8:
        return take_binary<std::int8_t>();
      case Scalar::uint8:
        return take_binary<std::uint8_t>();
      case Scalar::int16:
        return take_binary<std::int16_t>();
      case Scalar::uint16:
        return take_binary<std::uint16_t>();
      case Scalar::int32:
        return take_binary<std::int32_t>();
      case Scalar::uint32:
        return take_binary<std::uint32_t>();
      case Scalar::float32:
        return take_binary<float>();
      case Scalar::float64:
        return take_binary<double>();
    }
    return std::nullopt;
  }

  Status truncated(const Element& element, std::uint64_t index) const {
    return error("{}[{}]: the file ends, or has no number there", element.name, index);
  }

  /// Reads a property: one value, or those of a list.
  Status read_values(const Element& element, std::uint64_t index, const Property& property) {
    values_.clear();
    std::size_t count = 1;
    if (property.list_size) {
      const std::optional<double> size = take(*property.list_size);
      if (!size) {
        return truncated(element, index);
      }
      if (!(*size >= 0 && *size <= kMaxCorners && *size == std::floor(*size))) {
        return error("{}[{}].{}: a list of at most {} values is expected, got {}", element.name, index, property.name,
                     kMaxCorners, *size);
      }
      count = static_cast<std::size_t>(*size);
    }
    for (std::size_t i = 0; i < count; ++i) {
      const std::optional<double> value = take(property.type);
      if (!value) {
        return truncated(element, index);
      }
      values_.push_back(*value);
    }
    return ok_status();
  }

  /// Elements without properties take no bytes, so their number costs nothing.
  Status skip(const Element& element) {
    for (std::uint64_t i = 0; i < (element.properties.empty() ? 0 : element.count); ++i) {
      for (const Property& property : element.properties) {
        LM_RETURN_IF_ERROR(read_values(element, i, property));
      }
    }
    return ok_status();
  }

  static std::optional<std::size_t> find(const Element& element, std::string_view name) {
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      if (element.properties[i].name == name && !element.properties[i].list_size) {
        return i;
      }
    }
    return std::nullopt;
  }

  Status read_vertices(const Element& element) {
    std::array<std::optional<std::size_t>, 3> position, normal;
    std::array<std::optional<std::size_t>, 2> uv;
    for (std::size_t i = 0; i < 3; ++i) {
      position[i] = find(element, std::string(1, "xyz"[i]));
      normal[i] = find(element, fmt::format("n{}", "xyz"[i]));
    }
    for (const auto& [u, v] :
         {std::pair{"u", "v"}, {"s", "t"}, {"texture_u", "texture_v"}, {"texture_s", "texture_t"}}) {
      if (find(element, u) && find(element, v) && !uv[0]) {
        uv = {find(element, u), find(element, v)};
      }
    }
    if (!position[0] || !position[1] || !position[2]) {
      return error("vertices have no x, y and z");
    }
    const bool normals = normal[0] && normal[1] && normal[2];
    std::array color{find(element, "red"), find(element, "green"), find(element, "blue")};
    if (!color[0]) {
      color = {find(element, "diffuse_red"), find(element, "diffuse_green"), find(element, "diffuse_blue")};
    }
    const bool colors = notices_ != nullptr && color[0] && color[1] && color[2];
    const std::optional<std::size_t> alpha = colors ? find(element, "alpha") : std::nullopt;
    bool has_alpha = false;
    std::vector<double> row(element.properties.size());
    for (std::uint64_t index = 0; index < element.count; ++index) {
      for (std::size_t i = 0; i < row.size(); ++i) {
        LM_RETURN_IF_ERROR(read_values(element, index, element.properties[i]));
        row[i] = values_.empty() ? 0 : values_[0];
      }
      mesh_.positions.push_back({row[*position[0]], row[*position[1]], row[*position[2]]});
      if (normals) {
        const std::array<double, 3> n{row[*normal[0]], row[*normal[1]], row[*normal[2]]};
        const double length = std::hypot(n[0], n[1], n[2]);
        const auto part = [&](double x) {
          return static_cast<float>(length > 1e-30 && std::isfinite(length) ? x / length : 0);
        };
        mesh_.normals.push_back({part(n[0]), part(n[1]), part(n[2])});
      }
      if (colors) {
        const auto part = [&](std::size_t i) {
          return static_cast<float>(row[i] / most_of(element.properties[i].type));
        };
        mesh_.colors.push_back({part(*color[0]), part(*color[1]), part(*color[2]), 1});
        has_alpha = has_alpha || (alpha && part(*alpha) < 1);
      }
      if (uv[0]) {
        mesh_.texture_coordinates.push_back({static_cast<float>(row[*uv[0]]), static_cast<float>(row[*uv[1]])});
      }
    }
    decode_colors();
    if (has_alpha) {
      notices_->push_back(fmt::format("left out: alpha of vertex colours of {}", file_name_));
    }
    return ok_status();
  }

  /// From sRGB. Numbers without a range of their own that are above 1 count to 255.
  void decode_colors() {
    float largest = 0;
    for (const std::array<float, 4>& color : mesh_.colors) {
      largest = std::max({largest, color[0], color[1], color[2]});
    }
    const float whole = largest > 1.001f ? 255 : 1;
    for (std::array<float, 4>& color : mesh_.colors) {
      for (std::size_t i = 0; i < 3; ++i) {
        const double value = static_cast<double>(color[i] / whole);
        color[i] = static_cast<float>(srgb_decode_fixed(value >= 0 && value <= 1 ? value : value > 1 ? 1.0 : 0.0));
      }
    }
  }

  /// The value of a whole colour.
  static double most_of(Scalar type) { return type == Scalar::uint8 ? 255 : type == Scalar::uint16 ? 65535 : 1; }

  /// Polygons are cut later, because vertices may follow.
  Status read_faces(const Element& element) {
    std::size_t which = element.properties.size();
    for (std::size_t i = 0; i < element.properties.size(); ++i) {
      const Property& property = element.properties[i];
      if (property.list_size && (property.name == "vertex_indices" || property.name == "vertex_index")) {
        which = i;
      }
    }
    if (which == element.properties.size()) {
      return error("faces have no vertex_indices");
    }
    for (std::uint64_t index = 0; index < element.count; ++index) {
      for (std::size_t i = 0; i < element.properties.size(); ++i) {
        LM_RETURN_IF_ERROR(read_values(element, index, element.properties[i]));
        if (i != which) {
          continue;
        }
        face_sizes_.push_back(static_cast<std::uint32_t>(values_.size()));
        corners_.insert(corners_.end(), values_.begin(), values_.end());
      }
    }
    return ok_status();
  }

  Status check_indices() {
    const auto vertices = static_cast<double>(mesh_.positions.size());
    std::size_t at = 0;
    std::vector<std::array<double, 3>> points;
    std::vector<std::array<std::uint32_t, 3>> cut;
    for (std::size_t face = 0; face < face_sizes_.size(); ++face) {
      const std::size_t size = face_sizes_[face];
      points.clear();
      for (std::size_t i = 0; i < size; ++i) {
        const double corner = corners_[at + i];
        if (!(corner >= 0 && corner < vertices && corner == std::floor(corner))) {
          return error("face[{}]: there is no vertex {}, there are {}", face, corner, vertices);
        }
        points.push_back(mesh_.positions[static_cast<std::size_t>(corner)]);
        if (!std::ranges::all_of(points.back(), [](double x) { return std::abs(x) <= 1e30; })) {
          return error("vertex[{}]: coordinates must be finite and at most 1e30", corner);
        }
      }
      cut.clear();
      if (size >= 3) {
        triangulate(points, cut);
      }
      for (const auto& triangle : cut) {
        mesh_.triangles.push_back({index(at + triangle[0]), index(at + triangle[1]), index(at + triangle[2])});
      }
      at += size;
    }
    return mesh_.triangles.empty() ? error("there are no faces") : ok_status();
  }

  std::uint32_t index(std::size_t corner) const { return static_cast<std::uint32_t>(corners_[corner]); }

  std::string_view rest_;
  const std::string& file_name_;
  std::vector<std::string>* const notices_;
  int line_ = 0, unknown_ = 0;
  Format format_ = Format::ascii;
  std::vector<Element> elements_;
  std::vector<double> values_;             ///< of the property that was read last
  std::vector<std::uint32_t> face_sizes_;  ///< numbers of corners
  std::vector<double> corners_;            ///< indices of all faces
  Mesh mesh_;
};

}  // namespace

Result<Mesh> read_ply(std::string_view bytes, const std::string& file_name, std::vector<std::string>* notices) {
  return PlyReader(bytes, file_name, notices).read();
}

}  // namespace lightmill

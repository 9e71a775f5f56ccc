#include "common/scene_io/stl.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "common/scene_io/statement_reader.h"

namespace lightmill {
namespace {

constexpr std::size_t kHeaderBytes = 84;  ///< of a binary file: a comment, and the number of triangles
constexpr std::size_t kTriangleBytes = 50;
constexpr std::size_t kBeginning = 1'000;  ///< bytes in which a text file has its first facet
constexpr double kMostCoordinate = 1e30;

class StlReader {
 public:
  StlReader(std::string_view bytes, const std::string& file_name) : bytes_(bytes), file_name_(file_name) {}

  Result<Mesh> read(std::vector<std::string>& notices) {
    LM_RETURN_IF_ERROR(is_binary() ? read_binary(notices) : read_ascii());
    if (mesh_.triangles.empty()) {
      return error("there are no triangles");
    }
    LM_RETURN_IF_ERROR(with_context(validate(mesh_), file_name_));
    return std::move(mesh_);
  }

 private:
  template <class... Args>
  Status error(fmt::format_string<Args...> format, Args&&... args) const {
    return invalid_argument("{}: {}", file_name_, fmt::format(format, std::forward<Args>(args)...));
  }

  std::uint64_t triangles_by_header() const {
    std::uint32_t count = 0;
    std::memcpy(&count, bytes_.data() + kHeaderBytes - sizeof count, sizeof count);
    return count;
  }
  /// ASCII files begin with "solid", and have facets. Some binary ones begin so, too.
  bool is_binary() const {
    if (bytes_.size() < kHeaderBytes) {
      return false;
    }
    std::string_view rest = bytes_.substr(0, kBeginning);
    rest.remove_prefix(rest.starts_with("\xef\xbb\xbf") ? 3 : 0);  // a byte order mark
    const std::string text = lower(rest);
    const bool is_text =
        text.find_first_not_of(" \t\r\n") == text.find("solid") && text.find("facet") != std::string::npos;
    return !is_text || bytes_.size() == kHeaderBytes + triangles_by_header() * kTriangleBytes;
  }
  static std::string lower(std::string_view word) {
    std::string out(word);
    std::ranges::transform(out, out.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return out;
  }

  Status read_binary(std::vector<std::string>& notices) {
    const std::uint64_t count = triangles_by_header();
    if (count > (bytes_.size() - kHeaderBytes) / kTriangleBytes) {
      return error("the file ends before triangle {} of {}", (bytes_.size() - kHeaderBytes) / kTriangleBytes, count);
    }
    bool has_colors = false;
    for (std::uint64_t i = 0; i < count; ++i) {
      std::array<float, 12> values{};  // the normal, then the corners
      std::uint16_t attributes = 0;
      const char* const at = bytes_.data() + kHeaderBytes + i * kTriangleBytes;
      std::memcpy(values.data(), at, sizeof values);
      std::memcpy(&attributes, at + sizeof values, sizeof attributes);
      has_colors = has_colors || attributes != 0;
      std::array<Point, 3> corners;
      for (std::size_t c = 0; c < 3; ++c) {
        corners[c] = {values[3 + 3 * c], values[4 + 3 * c], values[5 + 3 * c]};
      }
      LM_RETURN_IF_ERROR(add(corners));
    }
    if (has_colors) {
      notices.push_back(fmt::format("left out: colours of {}, which programs write in different ways", file_name_));
    }
    return ok_status();
  }

  /// Takes the coordinates after each "vertex", and the three of each "facet" as a triangle. Other words only name and
  /// group them.
  Status read_ascii() {
    std::string_view rest = bytes_;
    rest.remove_prefix(rest.starts_with("\xef\xbb\xbf") ? 3 : 0);
    if (lower(take_word(rest)) != "solid") {
      return error("an STL file begins with \"solid\", or is binary with at least {} bytes", kHeaderBytes);
    }
    std::array<Point, 3> corners;
    std::size_t corner = 0;
    for (int line = 1; !rest.empty(); ++line) {
      const std::size_t end = std::min(rest.find('\n'), rest.size());
      std::string_view statement = rest.substr(0, end);
      rest.remove_prefix(std::min(end + 1, rest.size()));
      const std::string keyword = lower(take_word(statement));
      if (keyword == "vertex") {
        if (corner == 3) {
          return error("line {}: a facet has more than three vertices", line);
        }
        for (double& coordinate : corners[corner]) {
          const std::optional<double> value = parse_number(take_word(statement));
          if (!value) {
            return error("line {}: vertex: three numbers are expected", line);
          }
          coordinate = *value;
        }
        ++corner;
      } else if (keyword == "endfacet") {
        if (corner != 3) {
          return error("line {}: a facet has {} vertices, three are expected", line, corner);
        }
        LM_RETURN_IF_ERROR(add(corners));
        corner = 0;
      }
    }
    return corner == 0 ? ok_status() : error("the file ends within a facet");
  }

  using Point = std::array<double, 3>;

  Status add(const std::array<Point, 3>& corners) {
    std::array<std::uint32_t, 3> triangle{};
    for (std::size_t c = 0; c < 3; ++c) {
      if (!std::ranges::all_of(corners[c], [](double x) { return std::abs(x) <= kMostCoordinate; })) {
        return error("triangle {}: coordinates must be finite and at most 1e30", mesh_.triangles.size());
      }
      const Point point{corners[c][0] + 0.0, corners[c][1] + 0.0, corners[c][2] + 0.0};  // -0 becomes 0
      const auto [known, added] = vertices_.try_emplace(point, static_cast<std::uint32_t>(mesh_.positions.size()));
      if (added) {
        mesh_.positions.push_back(point);
      }
      triangle[c] = known->second;
    }
    mesh_.triangles.push_back(triangle);
    return ok_status();
  }

  const std::string_view bytes_;
  const std::string& file_name_;
  struct Hash {
    std::size_t operator()(const Point& p) const {
      std::uint64_t hash = 0;
      for (const double x : p) {
        hash = (hash ^ std::bit_cast<std::uint64_t>(x)) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 29;
      }
      return hash;
    }
  };
  std::unordered_map<Point, std::uint32_t, Hash> vertices_;
  Mesh mesh_;
};

}  // namespace

Result<Mesh> read_stl(std::string_view bytes, const std::string& file_name, std::vector<std::string>& notices) {
  return StlReader(bytes, file_name).read(notices);
}

}  // namespace lightmill

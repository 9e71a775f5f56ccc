#include "common/scene_io/mitsuba/mitsuba_serialized.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include "common/scene_io/text_lines.h"

namespace lightmill {
namespace {

static_assert(std::endian::native == std::endian::little);  // as the files

constexpr std::uint16_t kMagic = 0x041c;
enum Flags : std::uint32_t { kNormals = 1, kCoordinates = 2, kColors = 8, kFaceNormals = 0x10, kDoubles = 0x2000 };

template <class T>
std::optional<T> number_at(std::string_view bytes, std::uint64_t offset) {
  T out;
  if (offset > bytes.size() || bytes.size() - offset < sizeof(T)) {
    return std::nullopt;
  }
  std::memcpy(&out, bytes.data() + offset, sizeof(T));
  return out;
}

/// Unpacks a zlib stream. After a failure all reads fail.
class Inflater {
 public:
  Inflater(std::string_view in, SerializedBudget& budget) : in_(in), budget_(budget) {
    ok_ = inflateInit(&stream_) == Z_OK;
  }
  ~Inflater() { inflateEnd(&stream_); }
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  template <class T>
  T number() {
    T out{};
    read(&out, sizeof(T));
    return out;
  }

  /// Memory grows with what was unpacked, whatever count the file states.
  template <class T>
  std::vector<T> numbers(std::uint64_t count) {
    constexpr std::uint64_t kChunk = 1 << 16;
    std::vector<T> out;
    while (ok_ && out.size() < count) {
      const std::size_t begin = out.size();
      out.resize(begin + static_cast<std::size_t>(std::min(kChunk, count - begin)));
      read(out.data() + begin, (out.size() - begin) * sizeof(T));
    }
    return out;
  }
  /// Groups of `size` floats or doubles.
  std::vector<double> reals(std::uint64_t count, std::uint64_t size, bool doubles) {
    if (doubles) {
      return numbers<double>(count * size);
    }
    const std::vector<float> narrow = numbers<float>(count * size);
    return {narrow.begin(), narrow.end()};
  }

  bool ok() const { return ok_; }

 private:
  void read(void* to, std::size_t size) {
    ok_ = ok_ && size <= budget_.bytes;
    budget_.bytes -= ok_ ? size : 0;
    stream_.next_out = static_cast<Bytef*>(to);
    stream_.avail_out = static_cast<uInt>(size);  // at most a chunk
    while (ok_ && stream_.avail_out > 0) {
      if (stream_.avail_in == 0) {
        const std::size_t part = std::min<std::size_t>(in_.size(), 1 << 20);
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in_.data()));
        stream_.avail_in = static_cast<uInt>(part);
        in_.remove_prefix(part);
      }
      const int result = inflate(&stream_, Z_NO_FLUSH);
      ok_ = result == Z_OK || (result == Z_STREAM_END && stream_.avail_out == 0);
    }
  }

  std::string_view in_;
  SerializedBudget& budget_;
  z_stream stream_{};
  bool ok_ = false;
};

/// The begin of a mesh, from the table at the file's end. The first one begins at 0.
std::optional<std::uint64_t> begin_of(std::string_view bytes, std::size_t index, std::uint16_t version) {
  const auto count = number_at<std::uint32_t>(bytes, bytes.size() - 4);
  if (index == 0 || !count) {
    return index == 0 ? std::optional<std::uint64_t>(0) : std::nullopt;
  }
  const std::uint64_t entry = version == 3 ? 4 : 8, table = entry * *count;
  if (index >= *count || table > bytes.size() - 4) {
    return std::nullopt;
  }
  const std::uint64_t at = bytes.size() - 4 - table + entry * index;
  if (version == 3) {
    return number_at<std::uint32_t>(bytes, at);
  }
  return number_at<std::uint64_t>(bytes, at);
}

void set_normals(const std::vector<double>& given, Mesh& out) {
  for (std::size_t i = 0; i + 2 < given.size(); i += 3) {
    const double length = std::hypot(given[i], given[i + 1], given[i + 2]);
    if (!(length > 1e-30 && length < 1e30)) {
      out.normals.clear();
      return;
    }
    out.normals.push_back({static_cast<float>(given[i] / length), static_cast<float>(given[i + 1] / length),
                           static_cast<float>(given[i + 2] / length)});
  }
}

}  // namespace

Result<SerializedMesh> read_serialized(std::string_view bytes, const std::string& file_name, std::size_t index,
                                       SerializedBudget& budget) {
  const std::string name = utf8_name(file_name);
  const auto version = number_at<std::uint16_t>(bytes, 2);
  if (!version || number_at<std::uint16_t>(bytes, 0) != kMagic || (*version != 3 && *version != 4)) {
    return invalid_argument("{}: a serialized mesh of version 3 or 4 is expected", name);
  }
  const std::optional<std::uint64_t> begin = begin_of(bytes, index, *version);
  if (!begin || *begin > bytes.size() || bytes.size() - *begin < 4) {
    return invalid_argument("{}: there is no mesh {}", name, index);
  }
  Inflater in(bytes.substr(*begin + 4), budget);
  const auto flags = in.number<std::uint32_t>();
  if (*version == 4) {
    while (in.ok() && in.number<char>() != 0) {
    }
  }
  constexpr std::uint64_t kMost = 0xffffffff;
  const auto vertices = in.number<std::uint64_t>(), triangles = in.number<std::uint64_t>();
  if (!in.ok() || vertices > kMost || triangles > kMost) {
    return invalid_argument("{}: mesh {} cannot be unpacked", name, index);
  }
  const bool doubles = (flags & kDoubles) != 0;
  Mesh out;
  const std::vector<double> positions = in.reals(vertices, 3, doubles);
  for (std::size_t i = 0; i + 2 < positions.size(); i += 3) {
    out.positions.push_back({positions[i], positions[i + 1], positions[i + 2]});
  }
  if ((flags & kNormals) != 0) {
    set_normals(in.reals(vertices, 3, doubles), out);
  }
  if ((flags & kCoordinates) != 0) {
    const std::vector<double> all = in.reals(vertices, 2, doubles);
    for (std::size_t i = 0; i + 1 < all.size(); i += 2) {
      out.texture_coordinates.push_back({static_cast<float>(all[i]), static_cast<float>(all[i + 1])});
    }
  }
  if ((flags & kColors) != 0) {
    in.reals(vertices, 3, doubles);
  }
  const std::vector<std::uint32_t> corners = in.numbers<std::uint32_t>(3 * triangles);
  if (!in.ok()) {
    return invalid_argument("{}: mesh {} ends early, or is larger than can be read", name, index);
  }
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    out.triangles.push_back({corners[i], corners[i + 1], corners[i + 2]});
  }
  const Status valid = validate(out);
  return valid.ok() ? Result<SerializedMesh>(SerializedMesh{std::move(out), (flags & kFaceNormals) != 0})
                    : with_context(valid, name);
}

}  // namespace lightmill

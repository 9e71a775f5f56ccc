#include "common/scene_io/mitsuba/mitsuba_serialized.h"
#include "common/base/digest.h"
#include "common/base/text.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace lightmill {
namespace {

static_assert(std::endian::native == std::endian::little);  // as the files

constexpr std::uint16_t kMagic = 0x041c;
enum Flags : std::uint32_t { kNormals = 1, kCoordinates = 2, kColors = 8, kFaceNormals = 0x10, kDoubles = 0x2000 };

/// Numbers of a zlib stream. After its end or a fault, all further ones are 0. Memory depends on no counts in the file.
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
    std::array<char, sizeof(T)> bytes{};
    for (std::size_t done = 0; done < bytes.size() && fill();) {
      const std::size_t part = std::min(bytes.size() - done, end_ - begin_);
      std::memcpy(bytes.data() + done, buffer_.data() + begin_, part);
      begin_ += part;
      done += part;
    }
    return ok_ ? std::bit_cast<T>(bytes) : T{};
  }
  template <std::size_t kSize>
  std::array<double, kSize> reals(bool doubles) {
    std::array<double, kSize> out{};
    for (double& value : out) {
      value = doubles ? number<double>() : number<float>();
    }
    return out;
  }

  bool ok() const { return ok_; }

 private:
  /// Whether there are bytes to read.
  bool fill() {
    if (begin_ < end_) {
      return true;
    }
    stream_.next_out = reinterpret_cast<Bytef*>(buffer_.data());
    stream_.avail_out = static_cast<uInt>(buffer_.size());
    ok_ = ok_ && !ended_;
    while (ok_ && !ended_ && stream_.avail_out == buffer_.size()) {
      if (stream_.avail_in == 0) {
        const std::size_t part = std::min<std::size_t>(in_.size(), 1 << 20);
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in_.data()));
        stream_.avail_in = static_cast<uInt>(part);
        in_.remove_prefix(part);
      }
      const int result = inflate(&stream_, Z_NO_FLUSH);
      ended_ = result == Z_STREAM_END;
      ok_ = result == Z_OK || ended_;
    }
    begin_ = 0;
    end_ = buffer_.size() - stream_.avail_out;
    ok_ = ok_ && end_ > 0 && end_ <= budget_.bytes;
    budget_.bytes -= ok_ ? end_ : 0;
    return ok_;
  }

  std::string_view in_;
  SerializedBudget& budget_;
  z_stream stream_{};
  std::array<char, 1 << 15> buffer_{};
  std::size_t begin_ = 0, end_ = 0;  ///< of the bytes in the buffer that are still to be read
  bool ended_ = false, ok_ = false;
};

/// The first byte of a mesh, from the table at the file's end. The first one begins at 0.
std::optional<std::uint64_t> begin_of(ByteView bytes, std::size_t index, std::uint16_t version) {
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

std::array<float, 3> unit_normal(const std::array<double, 3>& v, bool& valid) {
  const double length = std::hypot(v[0], v[1], v[2]);
  valid = valid && length > 1e-30 && length < 1e30;
  return {static_cast<float>(v[0] / length), static_cast<float>(v[1] / length), static_cast<float>(v[2] / length)};
}

}  // namespace

Result<SerializedMesh> read_serialized(std::string_view bytes, const std::string& file_name, std::size_t index,
                                       SerializedBudget& budget) {
  const std::string name = utf8_text(file_name);
  const ByteView file = as_byte_view(bytes);
  const auto version = number_at<std::uint16_t>(file, 2);
  if (!version || number_at<std::uint16_t>(file, 0) != kMagic || (*version != 3 && *version != 4)) {
    return invalid_argument("{}: a serialized mesh of version 3 or 4 is expected", name);
  }
  const std::optional<std::uint64_t> begin = begin_of(file, index, *version);
  if (!begin || *begin > bytes.size() || bytes.size() - *begin < 4) {
    return invalid_argument("{}: there is no mesh {}", name, index);
  }
  Inflater in(bytes.substr(*begin + 4), budget);
  const auto flags = in.number<std::uint32_t>();
  if (*version == 4) {
    while (in.ok() && in.number<char>() != 0) {
    }
  }
  constexpr std::uint64_t kMax = 0xffffffff;
  const auto vertices = in.number<std::uint64_t>(), triangles = in.number<std::uint64_t>();
  if (!in.ok() || vertices > kMax || triangles > kMax) {
    return invalid_argument("{}: mesh {} cannot be unpacked", name, index);
  }
  const bool doubles = (flags & kDoubles) != 0;
  Mesh out;
  for (std::uint64_t i = 0; i < vertices && in.ok(); ++i) {
    out.positions.push_back(in.reals<3>(doubles));
  }
  bool normals = (flags & kNormals) != 0;
  for (std::uint64_t i = 0; (flags & kNormals) != 0 && i < vertices && in.ok(); ++i) {
    out.normals.push_back(unit_normal(in.reals<3>(doubles), normals));
  }
  if (!normals) {
    out.normals.clear();
  }
  for (std::uint64_t i = 0; (flags & kCoordinates) != 0 && i < vertices && in.ok(); ++i) {
    const auto [u, v] = in.reals<2>(doubles);
    out.texture_coordinates.push_back({static_cast<float>(u), static_cast<float>(v)});
  }
  for (std::uint64_t i = 0; (flags & kColors) != 0 && i < vertices && in.ok(); ++i) {
    in.reals<3>(doubles);
  }
  for (std::uint64_t i = 0; i < triangles && in.ok(); ++i) {
    std::array<std::uint32_t, 3> corners{};
    std::ranges::generate(corners, [&] { return in.number<std::uint32_t>(); });
    out.triangles.push_back(corners);
  }
  if (!in.ok()) {
    return invalid_argument("{}: mesh {} ends early, or is larger than can be read", name, index);
  }
  const Status valid = validate(out);
  return valid.ok() ? Result<SerializedMesh>(SerializedMesh{std::move(out), (flags & kFaceNormals) != 0})
                    : with_context(valid, name);
}

}  // namespace lightmill

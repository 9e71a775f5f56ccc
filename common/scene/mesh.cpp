#include "common/scene/mesh.h"

#include <bit>
#include <cmath>
#include <cstring>

#include "common/base/check.h"
#include "common/scene/document.h"

namespace lightmill {
namespace {

static_assert(std::endian::native == std::endian::little, "meshes are copied as they lie in memory");

struct Header {
  std::array<char, 4> magic{'L', 'M', 'M', '1'};
  std::uint32_t has_normals = 0;
  std::uint32_t positions = 0;
  std::uint32_t triangles = 0;
};
static_assert(sizeof(Header) == 16);

template <class T>
void append_array(std::string& bytes, const std::vector<T>& values) {
  bytes.append(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <class T>
std::vector<T> take_array(ByteView& bytes, std::size_t count) {
  std::vector<T> values(count);
  if (count > 0) {
    std::memcpy(values.data(), bytes.data(), count * sizeof(T));
  }
  bytes = bytes.subspan(count * sizeof(T));
  return values;
}

Status check_positions(const Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    for (const double value : mesh.positions[i]) {
      // Negated, so that NaN fails too.
      if (!(std::abs(value) <= kMaxCoordinate)) {
        return invalid_argument("positions[{}]: coordinates must be finite and at most {}, got {}", i, kMaxCoordinate,
                                value);
      }
    }
  }
  return ok_status();
}

Status check_normals(const Mesh& mesh) {
  if (!mesh.normals.empty() && mesh.normals.size() != mesh.positions.size()) {
    return invalid_argument("normals: none or one for each of {} positions are expected, got {}", mesh.positions.size(),
                            mesh.normals.size());
  }
  for (std::size_t i = 0; i < mesh.normals.size(); ++i) {
    const auto& [x, y, z] = mesh.normals[i];
    const float length_squared = x * x + y * y + z * z;
    if (!(std::abs(length_squared - 1) <= 1e-4f)) {
      return invalid_argument("normals[{}]: a unit vector is expected, got ({}, {}, {})", i, x, y, z);
    }
  }
  return ok_status();
}

}  // namespace

Status validate(const Mesh& mesh) {
  if (mesh.triangles.empty()) {
    return invalid_argument("triangles: the mesh is empty, at least one triangle is expected");
  }
  constexpr std::size_t kLimit = std::size_t{1} << 31;
  if (mesh.positions.size() > kLimit || mesh.triangles.size() > kLimit) {
    return resource_exhausted("the mesh has {} positions and {} triangles, at most {} of each are possible",
                              mesh.positions.size(), mesh.triangles.size(), kLimit);
  }
  LM_RETURN_IF_ERROR(check_positions(mesh));
  LM_RETURN_IF_ERROR(check_normals(mesh));
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    for (const std::uint32_t index : mesh.triangles[i]) {
      if (index >= mesh.positions.size()) {
        return invalid_argument("triangles[{}]: index {} is out of range, there are {} positions", i, index,
                                mesh.positions.size());
      }
    }
  }
  return ok_status();
}

std::string encode_mesh(const Mesh& mesh) {
  LM_CHECK(validate(mesh).ok(), "{}", message_of(validate(mesh)));
  const Header header{.has_normals = mesh.normals.empty() ? 0u : 1u,
                      .positions = static_cast<std::uint32_t>(mesh.positions.size()),
                      .triangles = static_cast<std::uint32_t>(mesh.triangles.size())};
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof header);
  bytes.reserve(sizeof header + mesh.positions.size() * 24 + mesh.normals.size() * 12 + mesh.triangles.size() * 12);
  append_array(bytes, mesh.positions);
  append_array(bytes, mesh.normals);
  append_array(bytes, mesh.triangles);
  return bytes;
}

Result<Mesh> decode_mesh(ByteView bytes) {
  Header header;
  if (bytes.size() < sizeof header) {
    return invalid_argument("mesh: {} bytes are less than a header", bytes.size());
  }
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != Header{}.magic || header.has_normals > 1) {
    return invalid_argument("mesh: the bytes do not begin as an LMM1 mesh");
  }
  bytes = bytes.subspan(sizeof header);
  // 64-bit arithmetic on 32-bit counts: no overflow, and nothing is allocated before the sizes agree.
  const std::uint64_t expected =
      std::uint64_t{header.positions} * (24 + 12 * header.has_normals) + std::uint64_t{header.triangles} * 12;
  if (bytes.size() != expected) {
    return invalid_argument("mesh: {} positions and {} triangles take {} bytes, got {}", header.positions,
                            header.triangles, expected, bytes.size());
  }
  Mesh mesh;
  mesh.positions = take_array<std::array<double, 3>>(bytes, header.positions);
  mesh.normals = take_array<std::array<float, 3>>(bytes, header.has_normals * std::size_t{header.positions});
  mesh.triangles = take_array<std::array<std::uint32_t, 3>>(bytes, header.triangles);
  if (Status status = validate(mesh); !status.ok()) {
    return with_context(status, "mesh");
  }
  return mesh;
}

}  // namespace lightmill

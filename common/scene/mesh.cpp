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
  std::uint32_t flags = 0;
  std::uint32_t positions = 0;
  std::uint32_t triangles = 0;
};
static_assert(sizeof(Header) == 16);
constexpr std::uint32_t kHasNormals = 1, kHasTextureCoordinates = 2, kHasTangents = 4, kHasColors = 8;
constexpr std::uint32_t kFlags = kHasNormals | kHasTextureCoordinates | kHasTangents | kHasColors;

/// 64-bit arithmetic on 32-bit counts cannot overflow.
std::uint64_t encoded_size(const Header& header) {
  const auto size_if = [&](std::uint32_t flag, std::uint64_t size) { return (header.flags & flag) != 0 ? size : 0; };
  const std::uint64_t per_position = 24 + size_if(kHasNormals, 12) + size_if(kHasTextureCoordinates, 8) +
                                     size_if(kHasColors, 16) + size_if(kHasTangents, 16);
  return sizeof header + header.positions * per_position + std::uint64_t{header.triangles} * 12;
}

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

Status check_texture_coordinates(const Mesh& mesh) {
  const auto& coordinates = mesh.texture_coordinates;
  if (!coordinates.empty() && coordinates.size() != mesh.positions.size()) {
    return invalid_argument("texture_coordinates: none or one for each of {} positions are expected, got {}",
                            mesh.positions.size(), coordinates.size());
  }
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    const auto& [u, v] = coordinates[i];
    if (!(std::abs(u) <= kMaxTextureCoordinate && std::abs(v) <= kMaxTextureCoordinate)) {
      return invalid_argument("texture_coordinates[{}]: must be finite and at most {}, got ({}, {})", i,
                              kMaxTextureCoordinate, u, v);
    }
  }
  return ok_status();
}

Status check_colors(const Mesh& mesh) {
  if (!mesh.colors.empty() && mesh.colors.size() != mesh.positions.size()) {
    return invalid_argument("colors: none or one for each of {} positions are expected, got {}", mesh.positions.size(),
                            mesh.colors.size());
  }
  for (std::size_t i = 0; i < mesh.colors.size(); ++i) {
    for (const float value : mesh.colors[i]) {
      if (!(value >= 0 && value <= 1)) {
        return invalid_argument("colors[{}]: must be in [0, 1], got {}", i, value);
      }
    }
  }
  return ok_status();
}

Status check_tangents(const Mesh& mesh) {
  if (!mesh.tangents.empty() && mesh.tangents.size() != mesh.positions.size()) {
    return invalid_argument("tangents: none or one for each of {} positions are expected, got {}",
                            mesh.positions.size(), mesh.tangents.size());
  }
  for (std::size_t i = 0; i < mesh.tangents.size(); ++i) {
    const auto& [x, y, z, sign] = mesh.tangents[i];
    if (!(std::abs(x * x + y * y + z * z - 1) <= 1e-4f && std::abs(sign) == 1)) {
      return invalid_argument("tangents[{}]: a unit vector and a sign are expected, got ({}, {}, {}, {})", i, x, y, z,
                              sign);
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
    return invalid_argument("the mesh has {} positions and {} triangles, at most {} of each are possible",
                            mesh.positions.size(), mesh.triangles.size(), kLimit);
  }
  LM_RETURN_IF_ERROR(check_positions(mesh));
  LM_RETURN_IF_ERROR(check_normals(mesh));
  LM_RETURN_IF_ERROR(check_texture_coordinates(mesh));
  LM_RETURN_IF_ERROR(check_colors(mesh));
  LM_RETURN_IF_ERROR(check_tangents(mesh));
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
  const Header header{.flags = (mesh.normals.empty() ? 0u : kHasNormals) |
                               (mesh.texture_coordinates.empty() ? 0u : kHasTextureCoordinates) |
                               (mesh.colors.empty() ? 0u : kHasColors) | (mesh.tangents.empty() ? 0u : kHasTangents),
                      .positions = static_cast<std::uint32_t>(mesh.positions.size()),
                      .triangles = static_cast<std::uint32_t>(mesh.triangles.size())};
  std::string bytes;
  bytes.reserve(encoded_size(header));
  bytes.append(reinterpret_cast<const char*>(&header), sizeof header);
  append_array(bytes, mesh.positions);
  append_array(bytes, mesh.normals);
  append_array(bytes, mesh.texture_coordinates);
  append_array(bytes, mesh.colors);
  append_array(bytes, mesh.tangents);
  append_array(bytes, mesh.triangles);
  return bytes;
}

Result<Mesh> decode_mesh(ByteView bytes) {
  Header header;
  if (bytes.size() < sizeof header) {
    return invalid_argument("mesh: {} bytes are less than a header", bytes.size());
  }
  std::memcpy(&header, bytes.data(), sizeof header);
  if (header.magic != Header{}.magic || (header.flags & ~kFlags) != 0) {
    return invalid_argument("mesh: the bytes do not begin as an LMM1 mesh");
  }
  // Checks the sizes before any memory is allocated.
  if (bytes.size() != encoded_size(header)) {
    return invalid_argument("mesh: {} positions and {} triangles take {} bytes, got {}", header.positions,
                            header.triangles, encoded_size(header) - sizeof header, bytes.size() - sizeof header);
  }
  bytes = bytes.subspan(sizeof header);
  const std::size_t positions = header.positions;
  Mesh mesh;
  mesh.positions = take_array<std::array<double, 3>>(bytes, positions);
  mesh.normals = take_array<std::array<float, 3>>(bytes, (header.flags & kHasNormals) != 0 ? positions : 0);
  mesh.texture_coordinates =
      take_array<std::array<float, 2>>(bytes, (header.flags & kHasTextureCoordinates) != 0 ? positions : 0);
  mesh.colors = take_array<std::array<float, 4>>(bytes, (header.flags & kHasColors) != 0 ? positions : 0);
  mesh.tangents = take_array<std::array<float, 4>>(bytes, (header.flags & kHasTangents) != 0 ? positions : 0);
  mesh.triangles = take_array<std::array<std::uint32_t, 3>>(bytes, header.triangles);
  LM_RETURN_IF_ERROR(with_context(validate(mesh), "mesh"));
  return mesh;
}

}  // namespace lightmill

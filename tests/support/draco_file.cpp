#include "tests/support/draco_file.h"

#include <draco/compression/encode.h>

#include <cmath>
#include <cstring>

#include "common/base/check.h"

namespace lightmill::test {
namespace {

draco::DataType data_type(std::uint32_t type) {
  switch (type) {
    case 5120:
      return draco::DT_INT8;
    case 5121:
      return draco::DT_UINT8;
    case 5122:
      return draco::DT_INT16;
    case 5123:
      return draco::DT_UINT16;
    case 5125:
      return draco::DT_UINT32;
    default:
      return draco::DT_FLOAT32;
  }
}

draco::GeometryAttribute::Type kind_of(DracoAttribute::Meaning meaning) {
  switch (meaning) {
    case DracoAttribute::Meaning::position:
      return draco::GeometryAttribute::POSITION;
    case DracoAttribute::Meaning::normal:
      return draco::GeometryAttribute::NORMAL;
    case DracoAttribute::Meaning::color:
      return draco::GeometryAttribute::COLOR;
    case DracoAttribute::Meaning::texture_coordinate:
      return draco::GeometryAttribute::TEX_COORD;
    default:
      return draco::GeometryAttribute::GENERIC;
  }
}

template <class T>
std::string numbers_of(const std::vector<T>& values) {
  std::string out(values.size() * sizeof(T), '\0');
  std::memcpy(out.data(), values.data(), out.size());
  return out;
}

}  // namespace

std::string draco_file(const DracoSource& source, DracoMethod method, int speed) {
  draco::Mesh mesh;
  mesh.set_num_points(source.vertices);
  mesh.SetNumFaces(source.triangles.size());
  for (std::uint32_t i = 0; i < source.triangles.size(); ++i) {
    const auto& [a, b, c] = source.triangles[i];
    mesh.SetFace(draco::FaceIndex(i), {draco::PointIndex(a), draco::PointIndex(b), draco::PointIndex(c)});
  }
  draco::Encoder encoder;
  for (const DracoAttribute& attribute : source.attributes) {
    const std::size_t stride = attribute.components * component_bytes(attribute.type);
    LM_CHECK(attribute.numbers.size() == stride * source.vertices);
    draco::GeometryAttribute made;
    made.Init(kind_of(attribute.meaning), nullptr, static_cast<std::uint8_t>(attribute.components),
              data_type(attribute.type), attribute.normalized, static_cast<std::int64_t>(stride), 0);
    const int id = mesh.AddAttribute(made, true, source.vertices);
    for (std::uint32_t vertex = 0; vertex < source.vertices; ++vertex) {
      mesh.attribute(id)->SetAttributeValue(draco::AttributeValueIndex(vertex),
                                            attribute.numbers.data() + vertex * stride);
    }
    if (attribute.quantization_bits > 0) {
      encoder.SetAttributeQuantization(kind_of(attribute.meaning), attribute.quantization_bits);
    }
  }
  encoder.SetSpeedOptions(speed, speed);
  encoder.SetEncodingMethod(method == DracoMethod::sequential ? draco::MESH_SEQUENTIAL_ENCODING
                                                              : draco::MESH_EDGEBREAKER_ENCODING);
  draco::EncoderBuffer out;
  const draco::Status status = encoder.EncodeMeshToBuffer(mesh, &out);
  LM_CHECK(status.ok(), "{}", status.error_msg_string());
  return {out.data(), out.size()};
}

MeshRequest request_for(const DracoSource& source) {
  MeshRequest request{source.vertices, source.triangles.size(), false, {}};
  for (const DracoAttribute& attribute : source.attributes) {
    request.attributes.push_back(
        {static_cast<std::uint32_t>(request.attributes.size()), attribute.type, attribute.components});
  }
  return request;
}

DracoSource draco_grid(std::uint32_t side) {
  using Meaning = DracoAttribute::Meaning;
  std::vector<float> positions, normals, coordinates, weights;
  std::vector<std::uint8_t> colors;
  std::vector<std::uint16_t> joints;
  for (std::uint32_t i = 0; i < side * side; ++i) {
    const auto x = static_cast<float>(i % side), y = static_cast<float>(i / side);
    const float z = 0.125f * static_cast<float>(i * 7 % 5);
    const float length = std::sqrt(1 + z * z);
    positions.insert(positions.end(), {x, y, z});
    normals.insert(normals.end(), {z / length, 0, 1 / length});
    coordinates.insert(coordinates.end(), {x / static_cast<float>(side), y / static_cast<float>(side)});
    weights.insert(weights.end(), {0.75f, 0.25f, 0, 0});
    for (std::uint32_t k = 0; k < 4; ++k) {
      colors.push_back(static_cast<std::uint8_t>(i * 31 + k * 17));
      joints.push_back(static_cast<std::uint16_t>((i + k) % 2));
    }
  }
  DracoSource out{side * side, {}, {}};
  for (std::uint32_t row = 0; row + 1 < side; ++row) {
    for (std::uint32_t column = 0; column + 1 < side; ++column) {
      const std::uint32_t corner = row * side + column;
      out.triangles.push_back({corner, corner + 1, corner + side});
      out.triangles.push_back({corner + side, corner + 1, corner + side + 1});
    }
  }
  out.attributes = {{Meaning::position, 5126, 3, numbers_of(positions)},
                    {Meaning::normal, 5126, 3, numbers_of(normals)},
                    {Meaning::texture_coordinate, 5126, 2, numbers_of(coordinates)},
                    {Meaning::color, 5121, 4, numbers_of(colors), true},
                    {Meaning::other, 5123, 4, numbers_of(joints)},
                    {Meaning::other, 5126, 4, numbers_of(weights)}};
  return out;
}

}  // namespace lightmill::test

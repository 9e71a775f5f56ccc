// Compressed meshes for tests, made by Draco's encoder.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/image/decoder/compressed_mesh.h"

namespace lightmill::test {

/// An attribute of each vertex, with the numbers of `type` (glTF's code) in memory order. Draco's ids count from 0.
struct DracoAttribute {
  enum class Meaning { position, normal, color, texture_coordinate, other };
  Meaning meaning = Meaning::position;
  std::uint32_t type = 5126, components = 3;
  std::string numbers;
  bool normalized = false;
  int quantization_bits = 0;  ///< 0: exact
};

struct DracoSource {
  std::uint32_t vertices = 0;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<DracoAttribute> attributes;
};

enum class DracoMethod { sequential, edgebreaker };

/// Sequential encoding keeps the order of vertices and triangles; edgebreaker changes it. The speed is from 0 to 10 (least
/// compression). Stops the program if it fails.
std::string draco_file(const DracoSource& source, DracoMethod method, int speed = 5);

/// A request for all of its attributes.
MeshRequest request_for(const DracoSource& source);

/// A bumpy grid of `side`² vertices. Positions, normals, texture coordinates and weights are floats, colours bytes, joints
/// 16-bit integers.
DracoSource draco_grid(std::uint32_t side);

}  // namespace lightmill::test

#include "common/scene_io/gltf/gltf_deform.h"

#include <cmath>

#include "common/scene_io/transforms.h"

namespace lightmill {
namespace {

/// Up to four joints of each vertex.
struct Influences {
  std::vector<std::array<double, 4>> joints, weights;
};

constexpr std::size_t kMaxSets = 4;

/// The sets JOINTS_0, JOINTS_1, … with their weights, at most kMaxSets. Empty after an error.
std::vector<Influences> read_influences(const GltfData& data, const JsonNode& primitive, std::size_t joints,
                                        const GltfVertices& vertices) {
  std::vector<Influences> sets;
  for (std::size_t set = 0; set < kMaxSets; ++set) {
    const JsonNode which = primitive["attributes"][fmt::format("JOINTS_{}", set)];
    const JsonNode weights = primitive["attributes"][fmt::format("WEIGHTS_{}", set)];
    if (!which.present() || !weights.present()) {
      break;
    }
    if (!has_all(data, which, "joints", vertices) || !has_all(data, weights, "weights of joints", vertices)) {
      return {};
    }
    sets.push_back({data.vectors<4>(which, vertices.used), data.vectors<4>(weights, vertices.used)});
    for (const std::array<double, 4>& four : sets.back().joints) {
      for (const double joint : four) {
        if (!(joint >= 0 && joint < static_cast<double>(joints))) {
          which.fail(fmt::format("joint {} is out of range, there are {}", joint, joints));
          return {};
        }
      }
    }
    if (!data.status().ok()) {
      return {};
    }
  }
  return sets;
}

/// The weighted mean of the maps of a vertex's joints. Without weights, that of the first joint.
Transform mean_map(const std::vector<Influences>& sets, std::size_t vertex, const std::vector<Transform>& joints) {
  Transform sum{};
  double total = 0;
  for (const Influences& set : sets) {
    for (std::size_t i = 0; i < 4; ++i) {
      const double weight = set.weights[vertex][i];
      if (!(weight > 0)) {
        continue;
      }
      total += weight;
      const Transform& joint = joints[static_cast<std::size_t>(set.joints[vertex][i])];
      for (std::size_t row = 0; row < 3; ++row) {
        for (std::size_t column = 0; column < 4; ++column) {
          sum[row][column] += weight * joint[row][column];
        }
      }
    }
  }
  if (!(total > 0)) {
    return joints[static_cast<std::size_t>(sets[0].joints[vertex][0])];
  }
  for (auto& row : sum) {
    for (double& value : row) {
      value /= total;
    }
  }
  return sum;
}

/// The map of normals: the matrix of cofactors, which exists where the map has no inverse. Times −1 if the map mirrors.
Transform normal_map_of(const Transform& t, bool mirrors) {
  Transform out{};
  const double sign = mirrors ? -1 : 1;
  for (std::size_t row = 0; row < 3; ++row) {
    const std::size_t r1 = (row + 1) % 3, r2 = (row + 2) % 3;
    for (std::size_t column = 0; column < 3; ++column) {
      const std::size_t c1 = (column + 1) % 3, c2 = (column + 2) % 3;
      out[row][column] = sign * (t[r1][c1] * t[r2][c2] - t[r1][c2] * t[r2][c1]);
    }
  }
  return out;
}

/// Maps a direction. It stays as it is if the map flattens it.
void map_direction(const Transform& t, float& x, float& y, float& z) {
  const Point3d to = map_vector(t, {x, y, z});
  const double length = std::hypot(to[0], to[1], to[2]);
  if (length > 1e-30 && std::isfinite(length)) {
    x = static_cast<float>(to[0] / length);
    y = static_cast<float>(to[1] / length);
    z = static_cast<float>(to[2] / length);
  }
}

}  // namespace

bool has_all(const GltfData& data, const JsonNode& attribute, std::string_view what, const GltfVertices& vertices) {
  const std::size_t count = data.count(attribute);
  if (data.status().ok() && count != vertices.count) {
    attribute.fail(fmt::format("{} {} are expected, got {}", vertices.count, what, count));
  }
  return data.status().ok();
}

bool count_deformed(const JsonNode& primitive, const MeshPose& pose, std::size_t vertices, std::size_t triangles,
                    std::uint64_t& deformed) {
  const auto moves = [](double weight) { return weight != 0; };
  const std::uint64_t arrays = (pose.joints != nullptr ? 2 * kMaxSets : 0) +
                               (pose.weights != nullptr ? std::ranges::count_if(*pose.weights, moves) : 0);
  deformed +=
      (vertices + triangles) * (1 + arrays) + primitive["targets"].size() + primitive["attributes"].keys().size();
  if (deformed > kMaxDeformed) {
    primitive.fail(fmt::format("skins and morph targets move too much: more than {} vertices, triangles and targets",
                               kMaxDeformed));
  }
  return deformed <= kMaxDeformed;
}

void add_morph_targets(const GltfData& data, const JsonNode& primitive, std::string_view attribute,
                       const MeshPose& pose, const GltfVertices& vertices,
                       std::vector<std::array<double, 3>>& vectors) {
  if (pose.weights == nullptr) {
    return;
  }
  const std::vector<double>& weights = *pose.weights;
  const JsonNode targets = primitive["targets"];
  for (std::size_t i = 0; i < std::min(targets.size(), weights.size()) && data.status().ok(); ++i) {
    const JsonNode target = targets.at(i)[attribute];
    if (weights[i] == 0 || !target.present() || !has_all(data, target, "vectors", vertices)) {
      continue;
    }
    const auto moves = data.vectors<3>(target, vertices.used);
    for (std::size_t v = 0; v < std::min(moves.size(), vectors.size()); ++v) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        vectors[v][axis] += weights[i] * moves[v][axis];
      }
    }
  }
}

void move_with_joints(const GltfData& data, const JsonNode& primitive, const MeshPose& pose,
                      const GltfVertices& vertices, Mesh& mesh) {
  const std::vector<Influences> sets = read_influences(data, primitive, pose.joints->size(), vertices);
  if (!data.status().ok()) {
    return;
  }
  std::vector<bool> mirrored(mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    const Transform map = sets.empty() ? pose.to_scene : mean_map(sets, v, *pose.joints);
    const bool mirrors = determinant(map) < 0;
    mirrored[v] = mirrors;
    mesh.positions[v] = map_point(map, mesh.positions[v]);
    if (!mesh.normals.empty()) {
      auto& [x, y, z] = mesh.normals[v];
      map_direction(normal_map_of(map, mirrors), x, y, z);
    }
    if (!mesh.tangents.empty()) {
      auto& [x, y, z, sign] = mesh.tangents[v];
      map_direction(map, x, y, z);
      sign = mirrors ? -sign : sign;
    }
  }
  for (auto& triangle : mesh.triangles) {
    if (mirrored[triangle[0]]) {
      std::swap(triangle[1], triangle[2]);
    }
  }
}

}  // namespace lightmill

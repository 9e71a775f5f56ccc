// Shapes of a pbrt scene as meshes and spheres.
#pragma once

#include <set>

#include "common/scene/mesh.h"
#include "common/scene_io/file_finder.h"
#include "common/scene_io/notices.h"
#include "common/scene_io/pbrt/pbrt_parameters.h"

namespace lightmill {

/// A shape in its own coordinates.
struct PbrtShape {
  std::optional<double> ball;  ///< a full sphere around the origin: its radius. Otherwise the shape is the mesh
  Mesh mesh;
  Transform to_object = kIdentityTransform;  ///< from the mesh's coordinates
  /// Triangles of one pbrt shape. Each of them has the full power of its light. 0: unknown.
  std::uint32_t triangles_per_shape = 1;
};

/// Reads shapes, with a limit on what they make out of few bytes.
class PbrtShapes {
 public:
  PbrtShapes(FileSource& files, Notices& notices, Faults& faults) : files_(files), notices_(notices), faults_(faults) {}

  /// `plain`: the material has no texture, so texture coordinates do not matter.
  Result<PbrtShape> read(const std::string& type, const PbrtParameters& from, bool plain);
  /// The mesh of a sphere that must be distorted or textured.
  Result<PbrtShape> sphere_of_triangles(double radius, const SourcePlace& place);

 private:
  Result<PbrtShape> sphere(const PbrtParameters& from, bool plain);
  Result<PbrtShape> disk(const PbrtParameters& from);
  Result<PbrtShape> cylinder(const PbrtParameters& from);
  Result<PbrtShape> triangles(const PbrtParameters& from, bool plain);
  Result<PbrtShape> patches(const PbrtParameters& from);
  Result<PbrtShape> subdivided(const PbrtParameters& from, bool plain);
  Result<PbrtShape> ply(const PbrtParameters& from, bool plain);
  /// Notes that a shape was cut into triangles, and counts them. Meshes of one type and form are equal, and kept once.
  Status cut(const std::string& type, const std::string& form, const SourcePlace& place, PbrtShape& shape);

  /// Counts the triangles of a curved shape. An error once there are too many, or too many different ones.
  Status count(std::size_t triangles, bool kept, const SourcePlace& place);

  FileSource& files_;
  Notices& notices_;
  Faults& faults_;
  std::set<std::string> forms_;
  std::size_t triangles_ = 0, kept_triangles_ = 0;  ///< of curved shapes
};

}  // namespace lightmill

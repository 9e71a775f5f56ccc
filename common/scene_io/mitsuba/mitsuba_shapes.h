// Shapes of a Mitsuba scene as meshes and spheres.
#pragma once

#include <map>

#include "common/scene_io/assets.h"
#include "common/scene_io/file_finder.h"
#include "common/scene_io/mitsuba/mitsuba_object.h"
#include "common/scene_io/mitsuba/mitsuba_serialized.h"
#include "common/scene_io/notices.h"

namespace lightmill {

/// Attributes of a mesh that a shape's material needs.
struct MitsubaMeshNeeds {
  bool coordinates = false;  ///< for textures
  bool tangents = false;     ///< for normal maps and anisotropic materials
};

/// A shape in its object's coordinates.
struct MitsubaShape {
  bool ball = false;    ///< a sphere, that of radius 1 around the origin. Otherwise the shape is the mesh
  bool inward = false;  ///< of a sphere: the normal points to the centre
  bool closed = false;  ///< its inside cannot be seen
  Sha256 mesh;          ///< its asset
  Transform to_world = kIdentityTransform;
};

/// Reads shapes. Those of equal form share their mesh.
class MitsubaShapes {
 public:
  MitsubaShapes(FileSource& files, LoadedScene& loaded, Notices& notices)
      : files_(files), loaded_(loaded), notices_(notices) {}

  /// Nested objects are not asked for, and the parameters are not finished.
  Result<MitsubaShape> read(const MitsubaObject& from, const MitsubaMeshNeeds& needs);

 private:
  Result<Mesh> mesh_of(const MitsubaObject& from, Transform& to_object);
  Result<Mesh> mesh_file(const MitsubaObject& from);
  Status open(const std::string& name);
  Result<Mesh> obj(const MitsubaObject& from, const SourceFile& file);
  Mesh cylinder(const MitsubaObject& from, Transform& to_object);

  FileSource& files_;
  LoadedScene& loaded_;
  Notices& notices_;
  SerializedBudget budget_;
  std::string open_name_;  ///< of file_, as it is written. The next mesh is often in the same file
  SourceFile file_;
  std::map<std::string, Sha256> known_;  ///< meshes by all that makes them
};

}  // namespace lightmill

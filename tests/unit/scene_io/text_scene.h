// Fixture of scenes that are read from texts in memory.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

#include "common/scene/mesh.h"
#include "common/scene_io/file_finder.h"
#include "common/scene_io/load.h"
#include "common/wire/scene_proto.h"
#include "tests/support/error_message.h"

namespace lightmill::test {

/// Bytes by the name of the file.
using TextFiles = std::map<std::string, std::string>;

inline FileSource source_of(TextFiles files) {
  return [files = std::move(files)](const std::string& name) -> Result<SourceFile> {
    const auto found = files.find(name);
    return found == files.end() ? Result<SourceFile>(not_found("cannot open {}", name))
                                : SourceFile{name, found->second};
  };
}

/// The read scene. Fails the test if there is an error, or if it cannot be packed and unpacked.
inline LoadedScene good_scene(Result<LoadedScene> loaded) {
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  if (!loaded.ok()) {
    return {};
  }
  const Result<Scene> back = unpack_scene(pack_scene(loaded->scene));
  EXPECT_TRUE(back.ok()) << back.status();
  return *std::move(loaded);
}

inline Mesh object_mesh(const LoadedScene& loaded, std::size_t object = 0) {
  const auto& shape = std::get<MeshShape>(loaded.scene.objects.at(object).shape);
  return decode_mesh(as_byte_view(loaded.assets.at(shape.asset))).value();
}

/// Texture coordinates as the image is looked up with them.
inline std::pair<double, double> mapped_coordinates(const TextureImage& image, double u, double v) {
  const double angle = image.rotation_degrees * std::numbers::pi / 180;
  const double x = u * image.scale[0], y = v * image.scale[1];
  return {std::cos(angle) * x - std::sin(angle) * y + image.offset[0],
          std::sin(angle) * x + std::cos(angle) * y + image.offset[1]};
}

inline void expect_near(const Point3d& a, const Point3d& b, double tolerance = 1e-12) {
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a[i], b[i], tolerance) << "[" << i << "]";
  }
}

}  // namespace lightmill::test

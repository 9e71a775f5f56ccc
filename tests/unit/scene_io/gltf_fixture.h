// Fixture of glTF files with one triangle.
#pragma once

#include "common/scene_io/gltf/gltf.h"
#include "tests/unit/scene_io/gltf_text.h"
#include "tests/unit/scene_io/text_scene.h"

namespace lightmill::test {

inline Result<SourceFile> no_files(const std::string& name) {
  return not_found("cannot open {}", name);
}

inline const std::string kPng = "\x89PNG\r\n\x1a\n";  // as much of a PNG as the reader checks

/// A file whose meshes[0] is one triangle, with more members. The buffer's views and accessors come first.
class OneTriangle {
 public:
  OneTriangle() {
    buffer_.positions({0, 0, 0, 1, 0, 0, 0, 1, 0});
    buffer_.add(packed<float>({0, 0, 1, 0, 0, 1}), "VEC2", 5126, 3);
    buffer_.add(kPng, "SCALAR", 5121, kPng.size());
  }
  std::string text(const std::string& members, const std::string& primitive = "") const {
    return gltf(fmt::format(
        R"({},"meshes":[{{"name":"tri","primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}}{}}}]}}],{})",
        buffer_.embedded(), primitive, members));
  }

 private:
  GltfBuffer buffer_;
};

inline Result<LoadedScene> read(const std::string& text, bool add_sky_if_unlit = true) {
  return read_gltf(text, "a.gltf", {.add_sky_if_unlit = add_sky_if_unlit}, no_files);
}

inline LoadedScene good(const std::string& text) {
  return good_scene(read(text));
}

inline std::string error(const std::string& members, const std::string& primitive = "") {
  return error_message(read(OneTriangle().text(members, primitive)));
}

inline const std::string kOneNode = R"("nodes":[{"mesh":0}])";

/// A file whose only material has these members, without a sky.
inline Material material(const std::string& members, std::vector<std::string>* notices = nullptr) {
  const Result<LoadedScene> loaded =
      read(OneTriangle().text(kOneNode + fmt::format(R"(,"materials":[{{{}}}])", members), R"(,"material":0)"), false);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  if (!loaded.ok()) {
    return {};
  }
  if (notices != nullptr) {
    *notices = loaded->notices;
  }
  return loaded->scene.materials.at(0);
}

inline Point3d moved(const Object& object, const Point3d& p) {
  Point3d out;
  for (std::size_t row = 0; row < 3; ++row) {
    const auto& t = object.transform[row];
    out[row] = t[0] * p[0] + t[1] * p[1] + t[2] * p[2] + t[3];
  }
  return out;
}

}  // namespace lightmill::test

// Fixture of Mitsuba scenes from text.
#pragma once

#include <gtest/gtest.h>

#include <map>

#include "common/scene_io/mitsuba/mitsuba.h"
#include "common/wire/scene_proto.h"

namespace lightmill::test {

using MitsubaFiles = std::map<std::string, std::string>;

inline Result<LoadedScene> read_xml(const std::string& text, const MitsubaFiles& files = {}) {
  return read_mitsuba(text, "a.xml", [files](const std::string& name) -> Result<SourceFile> {
    const auto found = files.find(name);
    return found == files.end() ? Result<SourceFile>(not_found("cannot open {}", name))
                                : SourceFile{name, found->second};
  });
}

/// A scene whose first line is line 2.
inline std::string scene_xml(const std::string& body) {
  return "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n" + body + "\n</scene>";
}

inline LoadedScene mitsuba_scene(const std::string& body, const MitsubaFiles& files = {}) {
  Result<LoadedScene> loaded = read_xml(scene_xml(body), files);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  if (!loaded.ok()) {
    return {};
  }
  const Result<Scene> back = unpack_scene(pack_scene(loaded->scene));
  EXPECT_TRUE(back.ok()) << back.status();
  return *std::move(loaded);
}

inline std::string mitsuba_error(const std::string& body, const MitsubaFiles& files = {}) {
  const Result<LoadedScene> loaded = read_xml(scene_xml(body), files);
  return loaded.ok() ? "no error" : message_of(loaded.status());
}

inline constexpr const char* kSphere = "<shape type=\"sphere\"/>";

/// The scene of a sphere with this bsdf.
inline LoadedScene with_bsdf(const std::string& bsdf) {
  return mitsuba_scene("<shape type=\"sphere\">" + bsdf + "</shape>", {{"a.png", "picture"}});
}

inline Material mitsuba_material(const std::string& bsdf) {
  const LoadedScene loaded = with_bsdf(bsdf);
  return loaded.scene.materials.empty() ? Material{} : loaded.scene.materials[0];
}

inline void expect_near(const Point3d& a, const Point3d& b, double tolerance = 1e-9) {
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_NEAR(a[i], b[i], tolerance) << "[" << i << "]";
  }
}

}  // namespace lightmill::test

// Fixture of Mitsuba scenes from text.
#pragma once

#include "common/scene_io/mitsuba/mitsuba.h"
#include "tests/unit/scene_io/text_scene.h"

namespace lightmill::test {

inline Result<LoadedScene> read_xml(const std::string& text, const TextFiles& files = {}) {
  return read_mitsuba(text, "a.xml", source_of(files));
}

/// A scene whose first line is line 2.
inline std::string scene_xml(const std::string& body) {
  return "<scene version=\"3.0.0\"><sensor type=\"perspective\"/>\n" + body + "\n</scene>";
}

inline LoadedScene mitsuba_scene(const std::string& body, const TextFiles& files = {}) {
  return good_scene(read_xml(scene_xml(body), files));
}

inline std::string mitsuba_error(const std::string& body, const TextFiles& files = {}) {
  return error_message(read_xml(scene_xml(body), files));
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

}  // namespace lightmill::test

// Fixture of pbrt scenes from text.
#pragma once

#include "common/scene_io/pbrt/pbrt.h"
#include "tests/unit/scene_io/text_scene.h"

namespace lightmill::test {

inline Result<LoadedScene> read_text(const std::string& text, const TextFiles& files = {}) {
  return read_pbrt(text, "a.pbrt", source_of(files));
}

/// A scene whose camera mirrors, so that the file's coordinates are the scene's.
inline constexpr std::string_view kUnmirrored =
    "Scale -1 1 1 Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 30 \"integer yresolution\" 20\n";

inline Result<LoadedScene> read_world(const std::string& text, const TextFiles& files = {}) {
  return read_text(fmt::format("{}WorldBegin\n{}", kUnmirrored, text), files);
}

inline LoadedScene world(const std::string& text, const TextFiles& files = {}) {
  return good_scene(read_world(text, files));
}

/// The message for a world whose first line is line 3.
inline std::string pbrt_error(const std::string& text, const TextFiles& files = {}) {
  return error_message(read_world(text, files));
}

/// The material of a sphere.
inline Material pbrt_material(const std::string& directives, std::vector<std::string>* notices = nullptr) {
  const LoadedScene loaded = world(directives + "\nShape \"sphere\"\n", {{"a.png", "picture"}});
  if (notices != nullptr) {
    *notices = loaded.notices;
  }
  return loaded.scene.materials.empty() ? Material{} : loaded.scene.materials[0];
}

}  // namespace lightmill::test

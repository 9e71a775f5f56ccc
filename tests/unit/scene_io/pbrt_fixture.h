// Fixture of pbrt scenes from text.
#pragma once

#include <gtest/gtest.h>

#include <map>

#include "common/scene_io/pbrt/pbrt.h"
#include "common/wire/scene_proto.h"

namespace lightmill::test {

using PbrtFiles = std::map<std::string, std::string>;

inline Result<LoadedScene> read_text(const std::string& text, const PbrtFiles& files = {}) {
  return read_pbrt(text, "a.pbrt", [files](const std::string& name) -> Result<SourceFile> {
    const auto found = files.find(name);
    return found == files.end() ? Result<SourceFile>(not_found("cannot open {}", name))
                                : SourceFile{name, found->second};
  });
}

/// A scene whose camera mirrors, so that the file's coordinates are the scene's.
inline constexpr std::string_view kUnmirrored =
    "Scale -1 1 1 Camera \"perspective\" Film \"rgb\" \"integer xresolution\" 30 \"integer yresolution\" 20\n";

inline LoadedScene world(const std::string& text, const PbrtFiles& files = {}) {
  Result<LoadedScene> loaded = read_text(fmt::format("{}WorldBegin\n{}", kUnmirrored, text), files);
  EXPECT_TRUE(loaded.ok()) << loaded.status();
  if (!loaded.ok()) {
    return {};
  }
  const Result<Scene> back = unpack_scene(pack_scene(loaded->scene));
  EXPECT_TRUE(back.ok()) << back.status();
  return *std::move(loaded);
}

/// The message for a world whose first line is line 3.
inline std::string pbrt_error(const std::string& text, const PbrtFiles& files = {}) {
  const Result<LoadedScene> loaded = read_text(fmt::format("{}WorldBegin\n{}", kUnmirrored, text), files);
  return loaded.ok() ? "no error" : message_of(loaded.status());
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

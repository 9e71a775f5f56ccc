// The Python script with which Blender exports a scene as glTF.
#pragma once

#include <string_view>

namespace lightmill::cli {

/// Run as `blender --background scene.blend --python FILE -- OUT.glb REPORT.json`. It writes the scene with modifiers
/// applied and area lights as emissive faces. It also writes a report: {"width", "height", "camera", "sky": [r, g, b],
/// "left_out": ["…"]}.
extern const std::string_view kBlenderScript;

}  // namespace lightmill::cli

// The checks of a scene document.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/scene/document.h"

namespace lightmill {

/// Everything that can be checked without the assets: ranges, finiteness, indices, at least one object. Errors have the
/// form "objects[3].sphere.radius: must be positive, got -1": the field's path in the schema, then the value and what
/// is expected.
Status validate(const Scene& scene);
Status validate(const Camera& camera);

using SceneAssets = std::map<Sha256, std::string>;  ///< encoded meshes, and files as they are

/// Of a valid scene whose meshes are there: INVALID_ARGUMENT, beginning with the path of the material, where one states
/// a power and the surfaces that it is used for have no area. A worker, which computes in single precision, may find
/// that of slivers too (compiled/light_builder.h).
Status check_powers(const Scene& scene, const SceneAssets& assets);

/// Pixels. An environment's texels are found by single-precision coordinates, which know this many columns with places
/// between them.
inline constexpr int kMaxEnvironmentSide = 65'536;
/// Of a decoded environment, beyond what decoding asks (image/decoder/decoder_process.h).
Status check_environment_size(int width, int height);

/// Whether a map leaves a volume a volume: its axes are at least 1e-30 long, and not in one plane.
bool spans_space(const Transform& t);
/// Each component in [0, 1].
Status check_reflectance(const std::string& path, const RgbColor& color);

/// `unknown material "whit"; the materials are red, green, white`: what to say of a name that is none of `materials`.
std::string describe_unknown_material(std::string_view name, const std::vector<Material>& materials);

}  // namespace lightmill

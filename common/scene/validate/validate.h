// Checks of a scene document.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/scene/document.h"

namespace lightmill {

/// Checks everything that needs no assets: ranges, finiteness, indices, at least one object. Errors have the form
/// "objects[3].sphere.radius: must be positive, got -1": the field's path in the schema, what is expected, and the
/// value.
Status validate(const Scene& scene);
Status validate(const Camera& camera);

using SceneAssets = std::map<Sha256, std::string>;  ///< encoded meshes, and files as they are

/// For a valid scene with its meshes: INVALID_ARGUMENT, beginning with the material's path, if a material states a
/// power but its surfaces have no area. A worker computes in single precision and may also refuse slivers
/// (compiled/light_builder.h).
Status check_powers(const Scene& scene, const SceneAssets& assets);

/// In pixels. Texels of an environment are found by single-precision coordinates, which can tell this many columns
/// apart.
inline constexpr int kMaxEnvironmentSide = 65'536;
/// Checks a decoded environment, in addition to the decoder's own limits (image/decoder/decoder_process.h).
Status check_environment_size(int width, int height, bool equal_area);

/// Whether a map keeps volumes: its axes are at least 1e-30 long, and not in one plane.
bool spans_space(const Transform& t);
/// Largest power, intensity, irradiance and radiance, and largest factor of them.
inline constexpr double kMaxPower = 1e20;

// For values that a file's format has and a scene does not.

/// In [low, high].
Status check_range(const std::string& path, double value, double low, double high);
/// Finite, within kMaxCoordinate, and not zero.
Status check_direction(std::string_view path, const Point3d& direction);
/// Each component in [0, 1].
Status check_reflectance(const std::string& path, const RgbColor& color);
/// Each component in [0, kMaxPower].
Status check_power(const std::string& path, const RgbColor& color);

/// `unknown material "whit". Known materials: red, green, white`: the error for a name that is not in `materials`.
std::string describe_unknown_material(std::string_view name, const std::vector<Material>& materials);

}  // namespace lightmill

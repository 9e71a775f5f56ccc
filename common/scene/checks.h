// The checks that parts of the document share; each error begins with the path of the field.
#pragma once

#include "common/scene/document.h"

namespace lightmill {

/// Finite and within kMaxCoordinate.
Status check_point(std::string_view path, const Point3d& point);
/// Like a point, and not zero.
Status check_direction(std::string_view path, const Point3d& direction);
/// Each component in [0, 1].
Status check_reflectance(const std::string& path, const RgbColor& color);
/// Each component in [0, 1e20].
Status check_power(const std::string& path, const RgbColor& color);
/// Of a cosⁿ profile.
Status check_exponent(const std::string& path, double exponent);

Status check_lights(const std::vector<Light>& lights);
/// The material's kind, and what fills it.
Status check_material_kind(const std::string& path, const Material& material);

}  // namespace lightmill

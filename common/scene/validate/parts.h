// The parts of validate(Scene). Each error begins with the path of the field.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/scene/validate/validate.h"

namespace lightmill {

/// Finite and within kMaxCoordinate.
Status check_point(std::string_view path, const Point3d& point);
/// Like a point, and not zero.
Status check_direction(std::string_view path, const Point3d& direction);
/// Each component in [0, 1e20].
Status check_power(const std::string& path, const RgbColor& color);
/// Of a cosⁿ profile.
Status check_exponent(const std::string& path, double exponent);
/// Of a light group: empty, or a name.
Status check_group(const std::string& path, const std::string& group);

Status check_film(const FilmSettings& film);
Status check_texture(const std::string& path, const TextureImage& texture);
Status check_material(const std::string& path, const Material& material);
/// `materials`: how many the scene has.
Status check_object(const std::string& path, const Object& object, std::size_t materials);
Status check_lights(const std::vector<Light>& lights);
Status check_meters(const std::vector<Meter>& meters);

}  // namespace lightmill

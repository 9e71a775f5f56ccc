// The parts of validate(Scene). Each error begins with the path of the field.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/validate/validate.h"

namespace lightmill {

/// Finite and within kMaxCoordinate.
Status check_point(std::string_view path, const Point3d& point);
/// Like a point, and not zero.
Status check_direction(std::string_view path, const Point3d& direction);
/// In [low, high].
Status check_range(const std::string& path, double value, double low, double high);
/// Each component in [0, limit].
Status check_components(const std::string& path, const RgbColor& color, double limit);
/// Each component in [0, 1e20].
Status check_power(const std::string& path, const RgbColor& color);
/// To about 1e-6; so is a vector of length zero.
bool are_parallel(const Point3d& a, const Point3d& b);
/// Not among `names`, which it joins. `what` bears the name.
Status check_new_name(std::set<std::string_view>& names, const std::string& path, const std::string& name,
                      std::string_view what);
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

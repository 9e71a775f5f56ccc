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
/// Each component in [0, limit].
Status check_components(const std::string& path, const RgbColor& color, double limit);
/// With a tolerance of about 1e-6. A vector of length zero is parallel to all.
bool are_parallel(const Point3d& a, const Point3d& b);
/// At most kMaxSceneNameBytes.
Status check_name_length(const std::string& path, const std::string& name);
/// Fails if `name` is among `names`, else adds it. `what` is the kind of thing that has the name.
Status check_new_name(std::set<std::string_view>& names, const std::string& path, const std::string& name,
                      std::string_view what);
/// A light group: empty, or a valid name.
Status check_group(const std::string& path, const std::string& group);

Status check_film(const FilmSettings& film);
Status check_texture(const std::string& path, const TextureImage& texture);
/// Of all textures of a scene.
Status check_tiles(const std::vector<TextureImage>& textures);
Status check_material(const std::string& path, const Material& material);
/// `materials`: number of the scene's materials.
Status check_object(const std::string& path, const Object& object, std::size_t materials);
Status check_lights(const std::vector<Light>& lights);
Status check_meters(const std::vector<Meter>& meters);

}  // namespace lightmill

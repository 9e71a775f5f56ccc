// Conversion of the parts of a scene between messages and values. Errors begin with the path of the field, as in
// "materials[3].roughness"; `path` is its beginning. Ranges are checked by validate.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "common/scene/document.h"

namespace lightmill::v1 {
class BumpMap;
class Color;
class Light;
class Material;
class Meter;
class NormalMap;
class Object;
class ScalarMap;
class Texture;
class Vec3;
}  // namespace lightmill::v1

namespace lightmill {

// ---- points, colours and asset names (scene_values.cpp) ----

void to_wire_point(const Point3d& point, v1::Vec3* out);
void to_wire_color(const RgbColor& color, v1::Color* out);

/// `given`: whether the document has the field. It must.
Result<Point3d> point_from_wire(const std::string& path, bool given, const v1::Vec3& point);
/// A colour without a texture.
Result<RgbColor> color_from_wire(const std::string& path, bool given, const v1::Color& color);

/// The asset of a packed document.
Result<Sha256> asset_from_wire(const std::string& path, const std::string& hex);

// ---- textures, and colours that name them (texture_proto.cpp) ----

/// Indices of textures by name.
using TextureNames = std::map<std::string, std::uint32_t, std::less<>>;

void to_wire_texture(const TextureImage& texture, const std::vector<TextureImage>& textures, v1::Texture* out);
/// Without the texture's asset. `earlier`: the textures before it.
Result<TextureImage> texture_from_wire(const std::string& path, const v1::Texture& texture,
                                       const TextureNames& earlier);

void to_wire_textured(const TexturedColor& color, const std::vector<TextureImage>& textures, v1::Color* out);
/// `given`: whether the document has the field. It must.
Result<TexturedColor> textured_from_wire(const std::string& path, bool given, const v1::Color& color,
                                         const TextureNames& textures);

void to_wire_map(const ScalarMap& map, const std::vector<TextureImage>& textures, v1::ScalarMap* out);
void to_wire_normal_map(const NormalMap& map, const std::vector<TextureImage>& textures, v1::NormalMap* out);
Result<NormalMap> normal_map_from_wire(const std::string& path, const v1::NormalMap& map, const TextureNames& textures);
void to_wire_bump_map(const BumpMap& map, const std::vector<TextureImage>& textures, v1::BumpMap* out);
Result<BumpMap> bump_map_from_wire(const std::string& path, const v1::BumpMap& map, const TextureNames& textures);
Result<ScalarMap> map_from_wire(const std::string& path, const v1::ScalarMap& map, const TextureNames& textures);

// ---- materials (material_proto.cpp) ----

void to_wire_material(const Material& material, const std::vector<TextureImage>& textures, v1::Material* out);

Result<Material> material_from_wire(const std::string& path, const v1::Material& material,
                                    const TextureNames& textures);

// ---- lights, and materials' emission (light_proto.cpp). Strengths with units become W/sr, W/m² or W/(m² sr) ----

void to_wire_light(const Light& light, v1::Light* out);
/// Without the light's asset.
Result<Light> light_from_wire(const std::string& path, const v1::Light& light);
/// The asset of a light in a packed document, if this kind has one.
Status light_asset_from_wire(const std::string& path, const v1::Light& light, Light& out);

/// All fields of a material that describe its emission.
void to_wire_emission(const Material& material, const std::vector<TextureImage>& textures, v1::Material* out);
Status emission_from_wire(const std::string& path, const v1::Material& material, const TextureNames& textures,
                          Material& out);

// ---- objects (object_proto.cpp) ----

void to_wire_object(const Object& object, const std::vector<Material>& materials, v1::Object* out);

/// Name, shape (without its asset) and transform; not the material.
Result<Object> object_from_wire(const std::string& path, const v1::Object& object);

// ---- virtual meters (meter_proto.cpp) ----

void to_wire_meter(const Meter& meter, v1::Meter* out);
Result<Meter> meter_from_wire(const std::string& path, const v1::Meter& meter);

}  // namespace lightmill

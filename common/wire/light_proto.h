// Conversion of lights and of materials' emission between messages and values. Strengths with units become W/sr, W/m²
// or W/(m² sr) here. Errors begin with the path of the field.
#pragma once

#include <string>

#include "common/scene/document.h"
#include "common/wire/texture_proto.h"

namespace lightmill::v1 {
class Light;
class Material;
}  // namespace lightmill::v1

namespace lightmill {

void to_wire_light(const Light& light, v1::Light* out);
/// Without the light's asset.
Result<Light> light_from_wire(const std::string& path, const v1::Light& light);
/// The asset of a light in a packed document, if this kind has one.
Status light_asset_from_wire(const std::string& path, const v1::Light& light, Light& out);

/// All fields of a material that describe its emission.
void to_wire_emission(const Material& material, const std::vector<TextureImage>& textures, v1::Material* out);
Status emission_from_wire(const std::string& path, const v1::Material& material, const TextureNames& textures,
                          Material& out);

}  // namespace lightmill

// Conversion of a scene's materials between messages and values.
#pragma once

#include <string>

#include "common/scene/document.h"
#include "common/wire/texture_proto.h"

namespace lightmill::v1 {
class Material;
}  // namespace lightmill::v1

namespace lightmill {

void to_wire_material(const Material& material, const std::vector<TextureImage>& textures, v1::Material* out);

/// `path` names the material in errors, as in "materials[3]". Ranges are checked by validate.
Result<Material> material_from_wire(const std::string& path, const v1::Material& material,
                                    const TextureNames& textures);

}  // namespace lightmill

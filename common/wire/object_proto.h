// Conversion of a scene's objects between messages and values. Errors begin with the path of the field.
#pragma once

#include <string>

#include "common/scene/document.h"

namespace lightmill::v1 {
class Object;
}

namespace lightmill {

void to_wire_object(const Object& object, const std::vector<Material>& materials, v1::Object* out);

/// Name, shape (without its asset) and transform; not the material.
Result<Object> object_from_wire(const std::string& path, const v1::Object& object);

}  // namespace lightmill

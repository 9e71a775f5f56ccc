// Conversion between Roles and lightmill.v1.Role.
#pragma once

#include <google/protobuf/repeated_field.h>

#include "common/base/status.h"
#include "common/security/roles.h"

namespace lightmill {

void to_wire(Roles roles, google::protobuf::RepeatedField<int>* out);
/// INVALID_ARGUMENT for an unknown role.
Result<Roles> roles_from_wire(const google::protobuf::RepeatedField<int>& roles);

}  // namespace lightmill

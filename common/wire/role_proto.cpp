#include "common/wire/role_proto.h"

#include "common/wire/enum_table.h"
#include "lightmill/v1/access_service.pb.h"

namespace lightmill {
namespace {

constexpr EnumTable<Role, v1::Role, kRoles.size()> kWireRoles{{{Role::view, v1::ROLE_VIEW},
                                                               {Role::submit, v1::ROLE_SUBMIT},
                                                               {Role::operate, v1::ROLE_OPERATE},
                                                               {Role::worker, v1::ROLE_WORKER},
                                                               {Role::admin, v1::ROLE_ADMIN},
                                                               {Role::enrol, v1::ROLE_ENROL}}};

}  // namespace

void to_wire(Roles roles, google::protobuf::RepeatedField<int>* out) {
  for (const auto& [role, wire] : kWireRoles) {
    if (roles.has(role)) {
      out->Add(wire);
    }
  }
}

Result<Roles> roles_from_wire(const google::protobuf::RepeatedField<int>& roles) {
  Roles all;
  for (const int role : roles) {
    LM_ASSIGN_OR_RETURN(const Role known, value_of(kWireRoles, static_cast<v1::Role>(role), "roles"));
    all.add(known);
  }
  return all;
}

}  // namespace lightmill

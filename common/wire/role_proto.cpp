#include "common/wire/role_proto.h"

#include <algorithm>
#include <array>
#include <utility>

#include "lightmill/v1/access_service.pb.h"

namespace lightmill {
namespace {

constexpr std::array<std::pair<Role, v1::Role>, kRoles.size()> kWireRoles{{{Role::view, v1::ROLE_VIEW},
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
    const auto found = std::ranges::find(kWireRoles, role, [](const auto& entry) { return entry.second; });
    if (found == kWireRoles.end()) {
      return invalid_argument("roles: unknown value {}", role);
    }
    all.add(found->first);
  }
  return all;
}

}  // namespace lightmill

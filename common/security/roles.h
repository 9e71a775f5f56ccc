// What somebody may do on a farm: a set of roles, which a certificate or a token carries.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// What each may call stands in server/access/rights.
enum class Role : std::uint8_t { view, submit, operate, worker, admin, enrol };

inline constexpr std::array kRoles{Role::view, Role::submit, Role::operate, Role::worker, Role::admin, Role::enrol};

class Roles {
 public:
  constexpr Roles() = default;
  constexpr Roles(std::initializer_list<Role> roles) {
    for (const Role role : roles) {
      add(role);
    }
  }
  static constexpr Roles all() {
    return {Role::view, Role::submit, Role::operate, Role::worker, Role::admin, Role::enrol};
  }

  constexpr bool has(Role role) const { return (bits_ >> static_cast<unsigned>(role) & 1u) != 0; }
  constexpr bool has_any(Roles of) const { return (bits_ & of.bits_) != 0; }
  constexpr bool empty() const { return bits_ == 0; }
  constexpr void add(Role role) { bits_ |= 1u << static_cast<unsigned>(role); }
  friend constexpr bool operator==(const Roles&, const Roles&) = default;

 private:
  unsigned bits_ = 0;
};

std::string_view name_of(Role role);
/// "view, submit": in the order of the enumeration.
std::string names_of(Roles roles);

/// Reads names with commas between them, at least one. INVALID_ARGUMENT names the one that is none.
Result<Roles> parse_roles(std::string_view text);

/// How a certificate names a role, among its subject's alternative names: lightmill://role/submit.
std::string role_uri(Role role);
/// Adds what the URI names; others are left alone, and false.
bool add_role_of_uri(std::string_view uri, Roles& roles);

}  // namespace lightmill

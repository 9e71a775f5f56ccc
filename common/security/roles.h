// Roles: what a certificate or a token allows on a farm.
#pragma once

#include <array>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

/// server/access/rights lists what each role may call.
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
/// "view, submit", in the order of the enumeration.
std::string names_of(Roles roles);

/// Reads at least one name, separated by commas. INVALID_ARGUMENT names an unknown one.
Result<Roles> parse_roles(std::string_view text);

/// The URI of a role among a certificate's alternative names: lightmill://role/submit.
std::string role_uri(Role role);
/// Adds the role that the URI names. False, and no change, if it names none.
bool add_role_of_uri(std::string_view uri, Roles& roles);

}  // namespace lightmill

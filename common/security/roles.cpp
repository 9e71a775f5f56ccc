#include "common/security/roles.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "common/base/suggestion.h"

namespace lightmill {
namespace {

constexpr std::string_view kUriStart = "lightmill://role/";

std::optional<Role> role_named(std::string_view name) {
  const auto found = std::ranges::find(kRoles, name, name_of);
  return found == kRoles.end() ? std::nullopt : std::optional(*found);
}

std::vector<std::string> list_of(Roles roles) {
  std::vector<std::string> names;
  for (const Role role : kRoles) {
    if (roles.has(role)) {
      names.emplace_back(name_of(role));
    }
  }
  return names;
}

}  // namespace

std::string_view name_of(Role role) {
  switch (role) {
    case Role::view:
      return "view";
    case Role::submit:
      return "submit";
    case Role::operate:
      return "operate";
    case Role::worker:
      return "worker";
    case Role::admin:
      return "admin";
    case Role::enrol:
      return "enrol";
  }
  return "unknown";
}

std::string names_of(Roles roles) {
  return fmt::format("{}", fmt::join(list_of(roles), ", "));
}

Result<Roles> parse_roles(std::string_view text) {
  Roles roles;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    std::string_view name = text.substr(at, end - at);
    name.remove_prefix(std::min(name.find_first_not_of(' '), name.size()));
    name = name.substr(0, name.find_last_not_of(' ') + 1);
    const std::optional<Role> role = role_named(name);
    if (!role) {
      // Without enrol: users do not name it. `lightmill tokens create NAME --enrol N` gives it.
      std::vector<std::string> known = list_of(Roles::all());
      std::erase(known, name_of(Role::enrol));
      return invalid_argument("{}", unknown_text("role", name, known));
    }
    roles.add(*role);
    at = end + 1;
  }
  return roles;
}

std::string role_uri(Role role) {
  return fmt::format("{}{}", kUriStart, name_of(role));
}

bool add_role_of_uri(std::string_view uri, Roles& roles) {
  const std::optional<Role> role = uri.starts_with(kUriStart) ? role_named(uri.substr(kUriStart.size())) : std::nullopt;
  if (role) {
    roles.add(*role);
  }
  return role.has_value();
}

}  // namespace lightmill

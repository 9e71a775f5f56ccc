// Metals by name, with complex indices of refraction for red, green and blue.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string_view>

namespace lightmill {

/// Indices at 650, 550 and 450 nm (red, green, blue). Gold, silver, copper and iron: measured by Johnson and Christy,
/// "Optical Constants of the Noble Metals" (1972) and "... of Transition Metals" (1974), linear between their photon
/// energies. Aluminium, chromium, nickel and platinum: the Lorentz-Drude model of Rakić et al. 1998, "Optical
/// properties of metallic films for vertical-cavity optoelectronic devices".
struct Metal {
  std::string_view name;
  std::array<float, 3> eta, k;
};

std::span<const Metal> metals();
/// The metal of this name; empty if there is none.
std::optional<Metal> find_metal(std::string_view name);

}  // namespace lightmill

// Photon stored at a surface or in a medium.
#pragma once

#include <cstdint>
#include <span>

#include "common/math/vec.h"

namespace lightmill::photons {

/// A photon at a surface, or where a medium scatters it: one row of sixteen words.
struct Photon {
  Vec3 point{0};
  Vec3 wi{0};      ///< unit, towards its origin
  Vec3 power{0};   ///< power that it carries, as a share of all light. In a medium, times the mean free path there
  Vec3 normal{0};  ///< geometric, oriented as the shape. In a medium 0
  std::uint32_t geometry = 0, primitive = 0;  ///< in a medium, `primitive` is the medium
  std::uint32_t tag = 0;        ///< light group from bit kTagGroupShift on; below, scatterings including this one
  std::uint32_t first : 1 = 0;  ///< it has met nothing or only casters before
  std::uint32_t path : 31 = 0;  ///< number of its path in the pass
};
inline constexpr int kTagGroupShift = 16;
inline constexpr std::uint32_t kMaxScatterings = (1u << kTagGroupShift) - 1;  ///< largest count of a tag

struct Photon8 {
  V8 point, wi, power, normal;
  U8 geometry, primitive;
  U8 group, scatterings;
};

/// The photons with these numbers; zero in other lanes.
inline Photon8 load_photons(std::span<const Photon> photons, U8 index, M8 lanes) {
  static_assert(sizeof(Photon) == 64);
  const auto* const words = reinterpret_cast<const float*>(photons.data());
  const U8 row = index << 4;
  const auto vector = [&](int at) {
    return V8{gather(words + at, row, lanes), gather(words + at + 1, row, lanes), gather(words + at + 2, row, lanes)};
  };
  const auto number = [&](int at) { return float_bits(gather(words + at, row, lanes)); };
  const U8 tag = number(14);
  return {vector(0),
          vector(3),
          vector(6),
          vector(9),
          number(12),
          number(13),
          tag >> kTagGroupShift,
          tag & U8((1u << kTagGroupShift) - 1)};
}

}  // namespace lightmill::photons

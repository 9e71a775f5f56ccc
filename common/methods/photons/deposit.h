// Where light of caustics has arrived.
#pragma once

#include <cstdint>
#include <span>

#include "common/math/vec.h"

namespace lightmill::photons {

/// A photon at a surface that is no caster: one row of sixteen words.
struct Deposit {
  Vec3 point{0};
  Vec3 wi{0};      ///< unit, to where it came from
  Vec3 power{0};   ///< its share of all light
  Vec3 normal{0};  ///< geometric, as the shape is oriented
  std::uint32_t geometry = 0, primitive = 0;
  std::uint32_t tag = 0;    ///< light group from kTagGroupShift on; below, scatterings up to this one, which counts
  std::uint32_t first = 0;  ///< 1: casters alone before, or nothing; 0: it has been at such surfaces before
};
inline constexpr int kTagGroupShift = 16;
inline constexpr std::uint32_t kMostScatterings = (1u << kTagGroupShift) - 1;  ///< of a photon

struct Deposit8 {
  V8 point, wi, power, normal;
  U8 geometry, primitive;
  U8 group, scatterings;
};

/// The deposits with these numbers; of other lanes all is zero.
inline Deposit8 load_deposits(std::span<const Deposit> deposits, U8 index, M8 lanes) {
  static_assert(sizeof(Deposit) == 64);
  const auto* const words = reinterpret_cast<const float*>(deposits.data());
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

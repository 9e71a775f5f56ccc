// Owen-scrambled Sobol' points in eight lanes, and hashed numbers. Samples have no other randomness.
//
// A point is a function of seed, pixel, half, decision and index. Each decision of a path takes a pair: the first two
// Sobol' dimensions, a (0,2)-sequence in base 2. Each half and decision shuffles the index (Burley 2020, "Practical
// Hash-based Owen Scrambling", JCGT 9(4)) and scrambles the digits by hashing (Laine and Karras 2011, with the
// constants of Vegdahl 2021).
#pragma once

#include <cstdint>

#include "common/math/simd.h"

namespace lightmill {

/// A 32-bit finaliser with good avalanche: "lowbias32" (Wellons 2018).
inline U8 mix(U8 x) {
  x = x ^ (x >> 16);
  x = x * U8(0x7feb352d);
  x = x ^ (x >> 15);
  x = x * U8(0x846ca68b);
  return x ^ (x >> 16);
}
inline std::uint32_t mix(std::uint32_t x) {
  x ^= x >> 16;
  x *= 0x7feb352d;
  x ^= x >> 15;
  x *= 0x846ca68b;
  return x ^ (x >> 16);
}

/// Nested uniform scrambling of bit-reversed numbers: each bit is flipped by a hash of the bits below it.
inline U8 scramble_reversed(U8 x, U8 seed) {
  x = x ^ (x * U8(0x3d20adea));
  x = x + seed;
  x = x * ((seed >> 16) | U8(1));
  x = x ^ (x * U8(0x05526c56));
  return x ^ (x * U8(0x53a22864));
}

/// The 24 high bits as a float in [0, 1).
inline F8 unit_float(U8 x) {
  return to_float(x >> 8) * F8(0x1p-24f);
}

struct Pair8 {
  F8 u, v;
};

/// The second Sobol' dimension of `index`, bit-reversed. Its generator is Pascal's triangle modulo 2: bit i of the
/// result is the sum of the index bits whose position contains i as a binary subset (Lucas). Five butterflies compute
/// it.
inline U8 sobol_second_reversed(U8 index) {
  index = index ^ ((index & U8(0xaaaaaaaa)) >> 1);
  index = index ^ ((index & U8(0xcccccccc)) >> 2);
  index = index ^ ((index & U8(0xf0f0f0f0)) >> 4);
  index = index ^ ((index & U8(0xff00ff00)) >> 8);
  return index ^ ((index & U8(0xffff0000)) >> 16);
}

/// Point `index` of the sequence scrambled by `seed` (one seed per pixel, half and decision).
inline Pair8 sobol_pair(U8 index, U8 seed) {
  const U8 shuffled = reverse_bits(scramble_reversed(reverse_bits(index), seed));
  const U8 first = scramble_reversed(shuffled, mix(seed ^ U8(0x9e3779b9)));
  const U8 second = scramble_reversed(sobol_second_reversed(shuffled), mix(seed ^ U8(0x3c6ef372)));
  return {unit_float(reverse_bits(first)), unit_float(reverse_bits(second))};
}

/// Two independent hashed numbers.
inline Pair8 hashed_pair(U8 index, U8 seed) {
  const U8 h = mix(index * U8(0x9e3779b9) + seed);
  return {unit_float(h), unit_float(mix(h ^ U8(0x68bc21eb)))};
}
inline F8 hashed_number(U8 index, U8 seed) {
  return unit_float(mix(index * U8(0x85ebca6b) + seed));
}

/// The scramble of one half of a pixel.
inline std::uint32_t pixel_seed(std::uint64_t seed, std::uint32_t x, std::uint32_t y, std::uint32_t half) {
  std::uint32_t h = mix(static_cast<std::uint32_t>(seed) ^ 0x2545f491u);
  h = mix(h ^ static_cast<std::uint32_t>(seed >> 32) ^ 0x9e3779b9u);
  h = mix(h + x * 0x8da6b343u);
  h = mix(h + y * 0xd8163841u);
  return mix(h ^ (half * 0xcb1ab31fu + 0x165667b1u));
}

/// The scramble of one decision.
inline U8 decision_seed(U8 pixel_seed, std::uint32_t decision) {
  return mix(pixel_seed ^ U8(decision * 0x632be5abu + 0x1b56c4e9u));
}

}  // namespace lightmill

// What a path's decisions are made from: fixed functions of the sample index, the pixel and the vertex.
#pragma once

#include <cstdint>

#include "common/methods/primary_rays.h"

namespace lightmill::path {

inline constexpr std::uint32_t kSobolVertices = 3;  ///< vertices whose decisions are Sobol' pairs
inline constexpr std::uint32_t kUnsplitSalt = 0x51ed270bu;

/// What depends on the sample index and nothing else: many short-lived paths at first, long ones later.
struct SamplePlan {
  std::uint32_t splits;       ///< paths that go on from the first surface that is not specular
  float roulette_boost;       ///< survival = min(1, boost · throughput)
  std::uint32_t index;        ///< point of the half's sequences, for decisions made once a sample
  std::uint32_t split_index;  ///< first of `splits` points, for decisions made once a split path

  explicit SamplePlan(std::uint64_t sample) : index(static_cast<std::uint32_t>(sample >> 1)) {
    constexpr std::uint32_t kSplitBelow = 64, kSplits = 4;
    const bool early = sample < kSplitBelow;
    splits = early ? kSplits : 1;
    roulette_boost = early ? 2.0f : 4.0f;
    split_index = early ? index * kSplits : index + kSplitBelow / 2 * (kSplits - 1);
  }
};

/// Decisions of vertex v: where on a light, which direction, and (which light, which lobe).
constexpr std::uint32_t light_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex;
}
constexpr std::uint32_t bsdf_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex + 1;
}
constexpr std::uint32_t choice_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex + 2;
}

/// Boundaries in a row that light does not notice: more are copies without end.
inline constexpr std::uint32_t kMaxPassed = 1000;
/// How far light gets in a medium after so many bounces, and so many boundaries passed since.
/// Beyond kLensDecision.
constexpr std::uint32_t medium_decision(std::uint32_t bounce, std::uint32_t passed) {
  return 0x50000000u + bounce * (kMaxPassed + 1) + passed;
}

inline Pair8 decide(U8 index, U8 pixel_seed, std::uint32_t vertex, std::uint32_t decision) {
  const U8 seed = decision_seed(pixel_seed, decision);
  return vertex < kSobolVertices ? sobol_pair(index, seed) : hashed_pair(index, seed);
}

/// Power heuristic (β = 2) for two techniques, as the first one's weight; Veach 1997, eq. 9.13.
inline F8 mis_weight(F8 pdf, F8 other_pdf) {
  const F8 ratio = other_pdf / pdf;
  return F8(1.0f) / (F8(1.0f) + ratio * ratio);
}

}  // namespace lightmill::path

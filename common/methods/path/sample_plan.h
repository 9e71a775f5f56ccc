// What a path's decisions are made from: fixed functions of the sample index, the pixel and the vertex.
#pragma once

#include <cstdint>

#include "common/methods/primary_rays.h"

namespace lightmill::path {

inline constexpr std::uint32_t kUnsplitSalt = 0x51ed270bu;

/// What was chosen by measurement (tests/bench/constants_bench measures it again). Samples' bits depend on all of it.
struct Constants {
  std::uint32_t splits = 2;          ///< paths that go on from the first surface that is not specular; at most 8
  std::uint32_t split_below = 256;   ///< the sample from which on it is one; even
  float early_roulette = 2.0f;       ///< survival = min(1, this · throughput) below `split_below`
  float late_roulette = 4.0f;        ///< from there on
  std::uint32_t first_roulette = 1;  ///< bounce from which on there is roulette
  std::uint32_t sobol_vertices = 3;  ///< vertices whose decisions are Sobol' pairs; those of later ones are hashed
};

/// What depends on the sample index and nothing else: split, shorter paths at first, longer ones later.
struct SamplePlan {
  std::uint32_t splits;
  float roulette_boost;
  std::uint32_t index;        ///< point of the half's sequences, for decisions made once a sample
  std::uint32_t split_index;  ///< first of `splits` points, for decisions made once a split path
  std::uint32_t first_roulette;
  std::uint32_t sobol_vertices;

  SamplePlan(std::uint64_t sample, const Constants& constants)
      : index(static_cast<std::uint32_t>(sample >> 1)),
        first_roulette(constants.first_roulette),
        sobol_vertices(constants.sobol_vertices) {
    const bool early = sample < constants.split_below;
    splits = early ? constants.splits : 1;
    roulette_boost = early ? constants.early_roulette : constants.late_roulette;
    split_index = early ? index * constants.splits : index + constants.split_below / 2 * (constants.splits - 1);
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

/// Which light path a vertex is connected to. Beyond those of vertices, below kLensDecision and medium_decision.
constexpr std::uint32_t connection_decision(std::uint32_t bounce) {
  return 0x30000000u + bounce;
}

/// Boundaries in a row that light does not notice: more are copies without end.
inline constexpr std::uint32_t kMaxPassed = 1000;
/// How far light gets in a medium after so many bounces, and so many boundaries passed since.
/// Beyond kLensDecision.
constexpr std::uint32_t medium_decision(std::uint32_t bounce, std::uint32_t passed) {
  return 0x50000000u + bounce * (kMaxPassed + 1) + passed;
}

inline Pair8 decide(U8 index, U8 pixel_seed, std::uint32_t vertex, std::uint32_t decision,
                    std::uint32_t sobol_vertices = Constants().sobol_vertices) {
  const U8 seed = decision_seed(pixel_seed, decision);
  return vertex < sobol_vertices ? sobol_pair(index, seed) : hashed_pair(index, seed);
}

/// Power heuristic (β = 2) for two techniques, as the first one's weight; Veach 1997, eq. 9.13.
inline F8 mis_weight(F8 pdf, F8 other_pdf) {
  const F8 ratio = other_pdf / pdf;
  return F8(1.0f) / (F8(1.0f) + ratio * ratio);
}

}  // namespace lightmill::path

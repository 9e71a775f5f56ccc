// Random decisions of paths, as fixed functions of sample index, pixel and vertex.
#pragma once

#include <cstdint>

#include "common/lights/light_choice.h"
#include "common/materials/bsdf.h"
#include "common/methods/camera_rays.h"
#include "common/methods/see_through.h"

namespace lightmill::tracer {

inline constexpr std::uint32_t kUnsplitSalt = 0x51ed270bu;

/// Constants chosen by measurement (tests/bench/constants_bench). The bits of samples depend on them.
struct Constants {
  std::uint32_t splits = 2;          ///< paths from the first surface, unless its BSDF is a delta; at most 8
  std::uint32_t split_below = 256;   ///< later samples have one path; even
  float early_roulette = 2.0f;       ///< survival = min(1, this · throughput) below `split_below`
  float late_roulette = 4.0f;        ///< from there on
  std::uint32_t first_roulette = 1;  ///< first bounce with Russian roulette
  std::uint32_t sobol_vertices = 3;  ///< vertices with Sobol' points; later ones have hashed numbers
};

/// Constants of one sample, which depend only on its index. Early samples have split and shorter paths.
struct SamplePlan {
  std::uint32_t splits;
  float roulette_boost;
  std::uint32_t index;        ///< point of the half's sequences, for decisions made once per sample
  std::uint32_t split_index;  ///< first of `splits` points, for decisions made once per split path
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

/// Decisions of vertex v: the point on a light, the direction, and the choice of light and lobe.
constexpr std::uint32_t light_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex;
}
/// The points on further lights. The numbers lie above those of vertices.
constexpr std::uint32_t light_decision(std::uint32_t vertex, std::uint32_t draw) {
  return light_decision(vertex) + draw * 0x08000000u;
}
static_assert(kMaxLightsTogether * 0x08000000u <= 0x20000000u);
constexpr std::uint32_t bsdf_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex + 1;
}
constexpr std::uint32_t choice_decision(std::uint32_t vertex) {
  return kFirstPathDecision + 3 * vertex + 2;
}

/// The light path to which a vertex connects. The numbers lie above those of lights, and below kLensDecision and
/// medium_decision.
constexpr std::uint32_t connection_decision(std::uint32_t bounce) {
  return 0x30000000u + bounce;
}

/// The distance in a medium, after these bounces and boundaries since the last bounce. The numbers lie above
/// kLensDecision.
constexpr std::uint32_t medium_decision(std::uint32_t bounce, std::uint32_t passed) {
  return 0x50000000u + bounce * (kMaxPassed + 1) + passed;
}

/// The scramble of all decisions of next-event estimation in the medium of that segment. The numbers lie above those of
/// medium_decision.
constexpr std::uint32_t inscattering_decision(std::uint32_t bounce, std::uint32_t passed) {
  return 0x90000000u + bounce * (kMaxPassed + 1) + passed;
}

inline Pair8 decide(U8 index, U8 pixel_seed, std::uint32_t vertex, std::uint32_t decision,
                    std::uint32_t sobol_vertices = Constants().sobol_vertices) {
  const U8 seed = decision_seed(pixel_seed, decision);
  return vertex < sobol_vertices ? sobol_pair(index, seed) : hashed_pair(index, seed);
}

/// Russian roulette: returns the lanes that survive, with probability min(1, survival). Divides what they carry by it.
inline M8 roulette(M8 lanes, F8 survival, U8 index, U8 pixel_seed, std::uint32_t vertex, V8& carried) {
  const M8 at_risk = survival < F8(1.0f);
  if ((lanes & at_risk).any()) {
    const F8 u = hashed_number(index, decision_seed(pixel_seed, choice_decision(vertex)));
    lanes = and_not(lanes, at_risk & (u >= survival));
    carried = carried * select(at_risk, F8(1.0f) / survival, F8(1.0f));
  }
  return lanes;
}

/// Samples a direction of a BSDF with a density. Not inlined, so that all estimators share one copy.
template <class Bsdf>
[[gnu::noinline]] BsdfSample8 draw_direction(const Bsdf& bsdf, const V8& wo, U8 index, U8 pixel_seed,
                                             std::uint32_t vertex,
                                             std::uint32_t sobol_vertices = Constants().sobol_vertices) {
  F8 choice(0.0f);
  if constexpr (Bsdf::kHasLobes) {
    choice = decide(index, pixel_seed, vertex, choice_decision(vertex), sobol_vertices).v;
  }
  return bsdf.sample(wo, decide(index, pixel_seed, vertex, bsdf_decision(vertex), sobol_vertices), choice);
}

}  // namespace lightmill::tracer

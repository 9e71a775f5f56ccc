// Choice of one of the scene's lights, and its probability.
#pragma once

#include <array>
#include <span>

#include "common/lights/light_bvh.h"
#include "common/lights/light_visibility.h"

namespace lightmill {

/// With up to this many lights, each shading point samples all of them, and none is chosen.
inline constexpr std::size_t kMaxLightsTogether = 4;

/// Chooses a light by a bound of each light's irradiance at a point. Bounded lights have the first numbers, infinitely
/// distant ones the next. Immutable once built.
///
/// Entries are subtrees of a light BVH and groups of distant lights. Up to kMaxEntries lights of either kind are
/// entries of their own. Each of the n entries with a bound above 0 has the probability
/// p = (1 − λ) bound / Σ bounds + λ / n. Bounds ignore occlusion. The second term limits the variance of this.
///
/// With learned visibilities v, p = (1 − λ − μ) v bound / Σ v bounds + μ bound / Σ bounds + λ / n.
class LightChoice {
 public:
  static constexpr std::size_t kMaxEntries = 16;
  /// λ. With one light per entry and without visibilities, if the lights that reach a point have the share s of all
  /// bounds, the relative variance of the choice is at most min(n / λ, 1 / ((1 − λ) s)) − 1.
  static constexpr float kUniformShare = 0.125f;

  /// μ: the share of draws that ignores visibilities, but not bounds. With it, the second moment of an estimate is at most
  /// (1 − λ)/μ = 4.4 times that without visibilities.
  static constexpr float kBoundShare = 0.2f;
  /// Numbers by entry.
  using Entries8 = std::array<F8, 2 * kMaxEntries>;
  static_assert(2 * kMaxEntries == LightVisibility::kMaxGroups);

  LightChoice() = default;
  /// All powers, intensities and irradiances must be positive.
  LightChoice(std::span<const LightBounds> bounded, std::span<const DistantBounds> distant);

  /// Whether lights are chosen. Otherwise each shading point samples all lights.
  bool chooses() const { return count_ > kMaxLightsTogether; }
  /// Whether `sample` uses its second number.
  bool needs_second_number() const { return has_subtrees_; }

  struct Choice8 {
    U8 light;
    F8 pmf;           ///< 0 if no light can illuminate the point
    F8 pmf_at_point;  ///< probability for a zero normal, with the bits of `pmf`
  };
  /// `normal`: unit, if only light from above it counts; else zero.
  Choice8 sample(const V8& p, const V8& normal, Pair8 u) const;
  /// The probability that `sample` returns a light for a zero normal.
  F8 pmf(const V8& p, U8 light, M8 lanes) const;
  std::uint64_t bytes() const { return tree_.bytes() + visibility_.bytes(); }

  std::size_t entries() const { return roots_.size() + distant_.size(); }
  /// Chooses a light of an entry. Its probability is among the entry's lights.
  Choice8 sample_entry(std::size_t entry, const V8& p, Pair8 u) const;
  /// The probabilities of the entries, with these visibilities instead of those that were set.
  Entries8 probabilities(const V8& p, const V8& normal, const LightVisibility& visibility) const;
  bool has_visibility() const { return !visibility_.empty(); }
  /// The groups are the entries.
  void set_visibility(LightVisibility visibility) { visibility_ = std::move(visibility); }

 private:
  struct DistantEntry {
    float bound;
    Vec3 direction;
    float radius;
  };
  Entries8 bounds(const V8& p) const;
  Entries8 above(const V8& p, const V8& normal, Entries8 bounds) const;
  /// Learned visibilities, by entry.
  struct Visible8 {
    bool known = false;
    Entries8 of;  ///< if known
  };
  Visible8 visible(const V8& p, const LightVisibility& visibility) const;
  Entries8 probabilities(Entries8 bounds, const Visible8& visible) const;
  /// Number of the first light of a group of distant lights, and the size of the group.
  struct Group8 {
    U8 first, size;
  };
  Group8 group(U8 number) const;

  std::size_t count_ = 0, bounded_ = 0;
  LightBvh tree_;
  std::vector<std::uint32_t> roots_;  ///< the first entries
  bool has_subtrees_ = false;
  std::vector<DistantEntry> distant_;  ///< the other entries
  LightVisibility visibility_;
  std::uint32_t group_size_ = 1;  ///< distant lights in a group; the last group may have fewer
};

}  // namespace lightmill

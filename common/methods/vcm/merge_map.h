// Merge map: finds the light vertices to merge with a point, with one photon map per octave of merging radii.
#pragma once

#include <algorithm>
#include <span>
#include <vector>

#include "common/math/transcendental.h"
#include "common/methods/photons/photon_map.h"

namespace lightmill::vcm {

/// Merging radii: the distance within which a light vertex and a camera vertex merge. The radius grows with the
/// distance from the camera, between limits. Lengths are in the scene's frame.
struct MergeRadii {
  Vec3 camera{0};
  float per_length = 0, least = 0, most = 0;
  F8 at(const V8& p) const {
    return min(max(sqrt(length_squared(p - broadcast(camera))) * F8(per_length), F8(least)), F8(most));
  }
  float at(const Vec3& p) const { return std::clamp(glm::length(p - camera) * per_length, least, most); }
  /// The merging factor η = π r² · light paths.
  F8 factor(const V8& p, std::uint32_t light_paths) const {
    const F8 radius = at(p);
    return radius * radius * F8(kPi * static_cast<float>(light_paths));
  }
};

/// Merging radii differ a thousandfold over a scene. A photon is in the map of each octave whose searches can reach it,
/// which is one or two. So a search visits eight cells at most, whose size is close to its radius. Where radii change
/// fast with position, octaves are wider.
///
/// Immutable. Its results and their order depend only on the photons and the radii.
class MergeMap {
 public:
  MergeMap() = default;
  MergeMap(std::span<const photons::Photon> photons, const MergeRadii& radii);

  bool empty() const { return octaves_.empty(); }
  /// Appends the numbers of the photons nearer to `p` than `radius`, which is the merging radius at `p`.
  void find(const Vec3& p, float radius, std::vector<std::uint32_t>& out) const;
  std::uint64_t bytes() const;

 private:
  std::size_t octave(float radius) const;

  std::vector<float> limits_;  ///< largest radius by octave
  std::vector<photons::PhotonMap> octaves_;
};

}  // namespace lightmill::vcm

#include "common/methods/vcm/merge_map.h"

#include <limits>

namespace lightmill::vcm {

/// Radii change by at most k = per_length times the distance. A search from p reaches a photon at d only if |r(p) −
/// r(d)| < k·r(p). So r(p) lies between r(d)/(1 + k) and r(d)/(1 − k). The octaves are at least as wide.
MergeMap::MergeMap(std::span<const photons::Photon> photons, const MergeRadii& radii) {
  if (photons.empty()) {
    return;
  }
  constexpr float kRounding = 1e-5f, kInfinite = std::numeric_limits<float>::infinity(), kMinCell = 0x1p-60f;
  const float k = radii.per_length;
  const float smaller = (1 - kRounding) / (1 + k), larger = k < 1 ? (1 + kRounding) / (1 - k) : kInfinite;
  const float width = std::max(2.0f, larger / smaller);
  limits_.push_back(std::max(radii.least, kMinCell) * width);
  while (limits_.back() < radii.most) {
    limits_.push_back(limits_.back() * width);
  }
  std::vector<std::vector<std::uint32_t>> filed(limits_.size());
  for (std::uint32_t number = 0; number < photons.size(); ++number) {
    const float radius = radii.at(photons[number].point);
    for (std::size_t i = octave(radius * smaller), last = octave(radius * larger); i <= last; ++i) {
      filed[i].push_back(number);
    }
  }
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const float cell = 2 * std::min(limits_[i], std::max(radii.most, kMinCell));
    octaves_.emplace_back(photons, filed[i], cell);
    std::vector<std::uint32_t>().swap(filed[i]);
  }
}

std::size_t MergeMap::octave(float radius) const {
  const auto found = std::ranges::lower_bound(limits_, radius);
  return static_cast<std::size_t>(std::min(found, limits_.end() - 1) - limits_.begin());
}

void MergeMap::find(const Vec3& p, float radius, std::vector<std::uint32_t>& out) const {
  if (!empty()) {
    octaves_[octave(radius)].find(p, radius, out);
  }
}

std::uint64_t MergeMap::bytes() const {
  std::uint64_t sum = 0;
  for (const photons::PhotonMap& map : octaves_) {
    sum += sizeof(photons::PhotonMap) + map.bytes();
  }
  return sum;
}

}  // namespace lightmill::vcm

#include "common/methods/photons/photon_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>

#include "common/base/check.h"

namespace lightmill::photons {
namespace {

/// Coordinates wrap at about 2^20 cells, so cells with the same number are far apart.
std::uint64_t cell_of(std::int64_t x, std::int64_t y, std::int64_t z) {
  constexpr std::int64_t kMask = (std::int64_t{1} << 21) - 1;
  return static_cast<std::uint64_t>(x & kMask) | static_cast<std::uint64_t>(y & kMask) << 21 |
         static_cast<std::uint64_t>(z & kMask) << 42;
}

}  // namespace

std::int64_t PhotonMap::coordinate(float x) const {
  constexpr float kLimit = 0x1p60f;
  return static_cast<std::int64_t>(std::floor(std::clamp(x * inverse_cell_, -kLimit, kLimit)));
}

std::size_t PhotonMap::bucket(std::uint64_t cell) const {
  const std::uint64_t mixed = cell * 0x9e3779b97f4a7c15u;
  return static_cast<std::size_t>((mixed ^ mixed >> 32) & (first_.size() - 2));
}

PhotonMap::PhotonMap(std::span<const Photon> photons, std::span<const std::uint32_t> chosen, float cell)
    : inverse_cell_(1 / cell) {
  LM_CHECK(cell > 0);
  if (chosen.empty()) {
    return;
  }
  first_.assign(2 * std::bit_ceil(chosen.size()) + 1, 0);
  std::vector<Entry> unsorted;
  unsorted.reserve(chosen.size());
  for (const std::uint32_t number : chosen) {
    const Vec3& p = photons[number].point;
    unsorted.push_back({cell_of(coordinate(p.x), coordinate(p.y), coordinate(p.z)), p, number});
    ++first_[bucket(unsorted.back().cell)];
  }
  std::exclusive_scan(first_.begin(), first_.end(), first_.begin(), std::uint32_t{0});
  std::vector<std::uint32_t> next = first_;
  entries_.resize(unsorted.size());
  for (const Entry& entry : unsorted) {
    entries_[next[bucket(entry.cell)]++] = entry;
  }
}

void PhotonMap::find(const Vec3& p, float radius, std::vector<std::uint32_t>& out) const {
  if (entries_.empty()) {
    return;
  }
  const float radius2 = radius * radius;
  for (std::int64_t z = coordinate(p.z - radius); z <= coordinate(p.z + radius); ++z) {
    for (std::int64_t y = coordinate(p.y - radius); y <= coordinate(p.y + radius); ++y) {
      for (std::int64_t x = coordinate(p.x - radius); x <= coordinate(p.x + radius); ++x) {
        const std::uint64_t cell = cell_of(x, y, z);
        const std::size_t b = bucket(cell);
        for (std::uint32_t i = first_[b]; i < first_[b + 1]; ++i) {
          const Vec3 d = entries_[i].point - p;
          if (entries_[i].cell == cell && glm::dot(d, d) < radius2) {
            out.push_back(entries_[i].photon);
          }
        }
      }
    }
  }
}

}  // namespace lightmill::photons

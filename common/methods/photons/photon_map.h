// Photon map: a hash grid that finds the photons near a point.
#pragma once

#include <span>
#include <vector>

#include "common/methods/photons/photon.h"

namespace lightmill::photons {

/// Immutable. Its results and their order depend only on the photons and the cell size.
class PhotonMap {
 public:
  PhotonMap() = default;
  /// Holds the photons with the numbers `chosen`. `cell`: side of a cell in the scene's frame, above 0.
  PhotonMap(std::span<const Photon> photons, std::span<const std::uint32_t> chosen, float cell);

  bool empty() const { return entries_.empty(); }
  /// Appends the numbers of the photons nearer than `radius`. Visits at most (2 + 2·radius/cell)³ cells.
  void find(const Vec3& p, float radius, std::vector<std::uint32_t>& out) const;
  std::uint64_t bytes() const { return entries_.size() * sizeof(Entry) + first_.size() * 4; }

 private:
  struct Entry {
    std::uint64_t cell;  ///< distinguishes cells that share a bucket
    Vec3 point;
    std::uint32_t photon;
  };
  std::int64_t coordinate(float x) const;
  std::size_t bucket(std::uint64_t cell) const;

  float inverse_cell_ = 1;
  std::vector<std::uint32_t> first_;  ///< first entry by bucket, and the end; a power of two of buckets
  std::vector<Entry> entries_;
};

}  // namespace lightmill::photons

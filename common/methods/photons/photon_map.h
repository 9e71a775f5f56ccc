// Photon map: a hash grid that finds the photons near a point.
#pragma once

#include <span>
#include <vector>

#include "common/methods/photons/photon.h"

namespace lightmill::photons {

/// Immutable. What it finds, and in which order, depends on the photons and the cell size alone.
class PhotonMap {
 public:
  PhotonMap() = default;
  /// Of the photons with the numbers `chosen`. `cell` is the side of a cell in the scene's frame, above 0.
  PhotonMap(std::span<const Photon> photons, std::span<const std::uint32_t> chosen, float cell);

  bool empty() const { return entries_.empty(); }
  /// Appends the numbers of the photons that are nearer than `radius`; costs (2 + 2·radius/cell)³ cells at most.
  void find(const Vec3& p, float radius, std::vector<std::uint32_t>& out) const;
  std::uint64_t bytes() const { return entries_.size() * sizeof(Entry) + first_.size() * 4; }

 private:
  struct Entry {
    std::uint64_t cell;  ///< two cells may share a bucket
    Vec3 point;
    std::uint32_t photon;
  };
  std::int64_t coordinate(float x) const;
  std::size_t bucket(std::uint64_t cell) const;

  float inverse_cell_ = 1;
  std::vector<std::uint32_t> first_;  ///< by bucket, a power of two of them, and the end
  std::vector<Entry> entries_;
};

}  // namespace lightmill::photons

// The planes that a reconstruction reads: a film with a border, its columns separated by parity.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "common/film/reconstruct.h"

namespace lightmill {

inline constexpr int kFeatures = 7;                ///< albedo, normal, 1/depth
inline constexpr std::size_t kFeaturePlanes = 10;  ///< of one half, with the squared lengths
inline constexpr int kCenterRows = 8;              ///< of a block of centers
inline constexpr int kCenterColumns = 32;          ///< of a block of centers
inline constexpr int kPad = 10;                    ///< pixels around the picture; even, enough for window and patch
inline constexpr float kUnknownVariance = 1e30f;   ///< variance of a pixel without both halves

/// Places of pixels in planes with a border of kPad. Even columns come before odd ones, so that eight neighbouring
/// centers lie side by side, and so do their neighbours at any offset.
struct PaddedPlaces {
  int height = 0;
  std::size_t stride = 0;  ///< of a row of one parity

  PaddedPlaces(int width, int height_in) : height(height_in) {
    const int blocks = (width + 2 * kCenterColumns - 1) / (2 * kCenterColumns);
    stride = static_cast<std::size_t>(blocks * kCenterColumns + kPad + 16);
  }
  std::size_t rows() const { return static_cast<std::size_t>(height + 2 * kPad); }
  std::size_t size() const { return 2 * rows() * stride; }
  std::size_t at(int x, int y) const {
    return (static_cast<std::size_t>((x + kPad) & 1) * rows() + static_cast<std::size_t>(y + kPad)) * stride +
           (static_cast<std::size_t>(x + kPad) >> 1);
  }
};

using PaddedPlane = std::vector<float>;

/// The film in such planes.
struct ReconstructionPlanes {
  PaddedPlaces places;
  std::array<std::array<PaddedPlane, 3>, 2> halves;
  PaddedPlane variance;  ///< of one half, summed over the channels and smoothed
  PaddedPlane known;     ///< 1 for pixels with both halves, else 0
  std::array<PaddedPlane, kFeatures> features;
  std::array<PaddedPlane, 3> feature_noise;  ///< variance of albedo, normal and 1/depth, per channel
  float brightness = 0;

  explicit ReconstructionPlanes(const ReconstructionInput& film);
};

}  // namespace lightmill

// Error of meters that photons light.
//
// All pixels of a meter's tile gather the photons of one pass, so their spread does not show the error. Each path of a
// pass belongs to one column of the tile. What it brings to all pixels is counted in its column, and the differences
// between columns are added to the pixels. They add up to zero. So the mean stays, and the spread of the columns' means
// gives the error of the reading (common/scene/meter_reading.h).
#pragma once

#include <array>
#include <bit>

#include "common/methods/photons/photon_pass.h"
#include "common/methods/tracer/wavefront.h"

namespace lightmill::photons {

/// What the photons of each column bring to the pixels of a meter in one sample.
class MeterColumns {
 public:
  /// Adds light of the photons with these numbers in `photons`, which are some of the pass.
  void add(const PhotonPass& pass, std::span<const Photon> photons, M8 lanes, U8 numbers, const V8& value) {
    alignas(32) std::uint32_t number[8];
    numbers.store(number);
    const VectorLanes values(value);
    for (auto bits = static_cast<unsigned>(lanes.bits()); bits != 0; bits &= bits - 1) {
      const int lane = std::countr_zero(bits);
      brought_.at(meter_column(photons[number[lane]].path, pass.plan.photons)) += Vec3d(values[lane]);
    }
  }
  /// Adds the differences to the pixels, and starts the next sample.
  void finish_sample(tracer::Wavefront& wavefront);

 private:
  std::array<Vec3d, kTileSize> brought_{};  ///< summed over the pixels
};

}  // namespace lightmill::photons

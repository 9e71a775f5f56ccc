// Photons on their way: structures of arrays, filled in order.
#pragma once

#include <array>
#include <vector>

#include "common/math/vec.h"
#include "common/methods/vcm/weights.h"
#include "common/scene/compiled/medium_table.h"

namespace lightmill::photons {

/// Eight photons as they wait for their next ray.
struct Photon8 {
  V8 origin, direction;
  V8 power;
  F8 scale;  ///< 1 / the largest component of the power that it began with: what roulette looks at
  U8 index;  ///< its number in the pass
  U8 tag;    ///< Deposit::tag, with the scatterings so far
  U8 met;    ///< 0 nothing yet, 1 casters alone, 2 other surfaces after them
  Media8 media;
  // Of light paths to be connected alone.
  vcm::Partial8 partial{F8(0.0f), F8(0.0f)};
  U8 light{0u};     ///< that it started at
  F8 cosine{1.0f};  ///< to that light's surface
};

class PhotonQueue {
 public:
  explicit PhotonQueue(std::size_t n) {
    for (auto& column : columns_) {
      column.resize(n + 8);  // stores are eight wide
    }
  }
  int size() const { return size_; }
  void clear() { size_ = 0; }

  Photon8 load(int i) const {
    const auto f = [&](int column) { return F8::load(&columns_[column][i]); };
    const auto u = [&](int column) { return float_bits(f(column)); };
    return {{f(0), f(1), f(2)},
            {f(3), f(4), f(5)},
            {f(6), f(7), f(8)},
            f(9),
            u(10),
            u(11),
            u(12),
            {u(13), u(14)},
            {f(15), f(16)},
            u(17),
            f(18)};
  }
  /// Appends the lanes of the mask, in order.
  void push(M8 lanes, const Photon8& p) {
    const int bits = lanes.bits();
    const U8 order = compress_order(bits);
    const std::array<F8, kColumns> values{p.origin.x,
                                          p.origin.y,
                                          p.origin.z,
                                          p.direction.x,
                                          p.direction.y,
                                          p.direction.z,
                                          p.power.x,
                                          p.power.y,
                                          p.power.z,
                                          p.scale,
                                          bits_float(p.index),
                                          bits_float(p.tag),
                                          bits_float(p.met),
                                          bits_float(p.media.low),
                                          bits_float(p.media.high),
                                          p.partial.vcm,
                                          p.partial.vc,
                                          bits_float(p.light),
                                          p.cosine};
    for (int column = 0; column < kColumns; ++column) {
      permute(values[column], order).store(&columns_[column][size_]);
    }
    size_ += std::popcount(static_cast<unsigned>(bits));
  }

 private:
  static constexpr int kColumns = 19;
  int size_ = 0;
  std::array<std::vector<float>, kColumns> columns_;
};

}  // namespace lightmill::photons

// Vertices of camera paths that wait to be connected to vertices of light paths.
#pragma once

#include <array>
#include <vector>

#include "common/math/vec.h"
#include "common/scene/compiled/medium_table.h"

namespace lightmill::path {

/// Eight ends of camera paths, each with the deposit that it is to be connected to.
struct Connection8 {
  V8 origin;  ///< off the surface, on the deposit's side
  V8 value;   ///< of what arrives from there, per radiance: throughput · BSDF · cosine
  U8 slot;
  U8 deposit;    ///< its number in the pass
  F8 pdf;        ///< of the camera path going there by itself, per solid angle
  F8 behind;     ///< of its vertex: see vcm::behind
  F8 cosine;     ///< at its surface, geometric
  Media8 media;  ///< at the origin
};

/// So many are traced at once: a piece of some 3 MiB, in which hardly a lane is idle.
inline constexpr std::uint32_t kConnectionsAtOnce = 65536;

/// Filled in order, up to its capacity: whoever pushes looks whether it is full first.
class ConnectionQueue {
 public:
  /// `capacity`: at least 1.
  void reserve(std::uint32_t capacity) {
    capacity_ = static_cast<int>(capacity);
    for (auto& column : columns_) {
      column.resize(std::size_t{capacity} + 16);  // the last push may go seven beyond; stores and loads are eight wide
    }
  }
  bool full() const { return size_ >= capacity_; }
  int size() const { return size_; }
  void clear() { size_ = 0; }

  Connection8 load(int i) const {
    const auto f = [&](int column) { return F8::load(&columns_[column][i]); };
    const auto u = [&](int column) { return float_bits(f(column)); };
    return {{f(0), f(1), f(2)}, {f(3), f(4), f(5)}, u(6), u(7), f(8), f(9), f(10), {u(11), u(12)}};
  }
  /// Appends the lanes of the mask, in order. Not to one that is full.
  void push(M8 lanes, const Connection8& c) {
    const int bits = lanes.bits();
    const U8 order = compress_order(bits);
    const std::array<F8, kColumns> values{c.origin.x,
                                          c.origin.y,
                                          c.origin.z,
                                          c.value.x,
                                          c.value.y,
                                          c.value.z,
                                          bits_float(c.slot),
                                          bits_float(c.deposit),
                                          c.pdf,
                                          c.behind,
                                          c.cosine,
                                          bits_float(c.media.low),
                                          bits_float(c.media.high)};
    for (int column = 0; column < kColumns; ++column) {
      permute(values[column], order).store(&columns_[column][size_]);
    }
    size_ += std::popcount(static_cast<unsigned>(bits));
  }

 private:
  static constexpr int kColumns = 13;
  int size_ = 0, capacity_ = 0;
  std::array<std::vector<float>, kColumns> columns_;
};

}  // namespace lightmill::path

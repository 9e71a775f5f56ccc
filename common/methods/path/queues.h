// The two queues of a breadth-first batch: paths to go on with and shadow rays to try. Structures of arrays, filled in
// order.
#pragma once

#include <cstdint>
#include <vector>

#include "common/math/vec.h"
#include "common/methods/vcm/weights.h"
#include "common/scene/compiled/medium_table.h"

namespace lightmill::path {

/// Three arrays of floats, one vector an entry.
struct VectorArray {
  std::vector<float> x, y, z;
  void resize(std::size_t n) {
    x.resize(n);
    y.resize(n);
    z.resize(n);
  }
  V8 load(int i) const { return {F8::load(&x[i]), F8::load(&y[i]), F8::load(&z[i])}; }
  void store(int i, const V8& v) {
    v.x.store(&x[i]);
    v.y.store(&y[i]);
    v.z.store(&z[i]);
  }
};

inline V8 permute(const V8& v, U8 order) {
  return {lightmill::permute(v.x, order), lightmill::permute(v.y, order), lightmill::permute(v.z, order)};
}

/// Eight paths as they wait for their next ray.
struct Path8 {
  V8 origin, direction;
  V8 throughput;       ///< of the path so far, divided by the number of paths it was split into
  F8 pdf_solid_angle;  ///< of `direction` by the last BSDF; 0 after a delta BSDF or from the camera
  F8 roulette_scale;   ///< brings the throughput to what roulette looks at: times splits, times η² of refractions
  U8 slot;             ///< where its light is added: split · pixels of the tile + pixel
  U8 pixel_seed;
  U8 index;           ///< point of the path's sequences
  Media8 media = {};  ///< that the path is in; kept only where the scene has such
  // Kept only where there is a light side.
  U8 chain = U8(0u);                          ///< kFromEye, kFromReceiver or kOverCasters
  F8 way = F8(0.0f);                          ///< length of the path up to `origin`
  vcm::Partial8 partial{F8(0.0f), F8(0.0f)};  ///< kept only where paths are connected
};

/// Over casters alone (and delta lobes of receivers) since the eye.
inline constexpr std::uint32_t kFromEye = 0;
/// The last surface was no caster: a receiver.
inline constexpr std::uint32_t kFromReceiver = 1;
/// Over casters since a receiver: the light found so is the light side's.
inline constexpr std::uint32_t kOverCasters = 2;

class PathQueue {
 public:
  void reserve(std::size_t n, bool with_media, bool with_chain, bool with_partials) {
    n += 8;  // stores are eight wide
    with_media_ = with_media;
    with_chain_ = with_chain;
    with_partials_ = with_partials;
    if (with_partials) {
      vcm_.resize(n);
      vc_.resize(n);
    }
    if (with_chain) {
      chain_.resize(n);
      way_.resize(n);
    }
    if (with_media) {
      media_low_.resize(n);
      media_high_.resize(n);
    }
    origin_.resize(n);
    direction_.resize(n);
    throughput_.resize(n);
    pdf_.resize(n);
    roulette_scale_.resize(n);
    slot_.resize(n);
    pixel_seed_.resize(n);
    index_.resize(n);
  }
  int size() const { return size_; }
  void clear() { size_ = 0; }

  Path8 load(int i) const {
    return {origin_.load(i),
            direction_.load(i),
            throughput_.load(i),
            F8::load(&pdf_[i]),
            F8::load(&roulette_scale_[i]),
            U8::load(&slot_[i]),
            U8::load(&pixel_seed_[i]),
            U8::load(&index_[i]),
            with_media_ ? Media8{U8::load(&media_low_[i]), U8::load(&media_high_[i])} : Media8{},
            with_chain_ ? U8::load(&chain_[i]) : U8(0u),
            with_chain_ ? F8::load(&way_[i]) : F8(0.0f),
            with_partials_ ? vcm::Partial8{F8::load(&vcm_[i]), F8::load(&vc_[i])} : vcm::Partial8{F8(0.0f), F8(0.0f)}};
  }
  /// Appends the lanes of the mask, in order.
  void push(M8 lanes, const Path8& p) {
    const int bits = lanes.bits();
    const U8 order = compress_order(bits);
    const int i = size_;
    origin_.store(i, permute(p.origin, order));
    direction_.store(i, permute(p.direction, order));
    throughput_.store(i, permute(p.throughput, order));
    lightmill::permute(p.pdf_solid_angle, order).store(&pdf_[i]);
    lightmill::permute(p.roulette_scale, order).store(&roulette_scale_[i]);
    lightmill::permute(p.slot, order).store(&slot_[i]);
    lightmill::permute(p.pixel_seed, order).store(&pixel_seed_[i]);
    lightmill::permute(p.index, order).store(&index_[i]);
    if (with_media_) {
      lightmill::permute(p.media.low, order).store(&media_low_[i]);
      lightmill::permute(p.media.high, order).store(&media_high_[i]);
    }
    if (with_chain_) {
      lightmill::permute(p.chain, order).store(&chain_[i]);
      lightmill::permute(p.way, order).store(&way_[i]);
    }
    if (with_partials_) {
      lightmill::permute(p.partial.vcm, order).store(&vcm_[i]);
      lightmill::permute(p.partial.vc, order).store(&vc_[i]);
    }
    size_ += std::popcount(static_cast<unsigned>(bits));
  }

 private:
  int size_ = 0;
  bool with_media_ = false, with_chain_ = false, with_partials_ = false;
  VectorArray origin_, direction_, throughput_;
  std::vector<float> pdf_, roulette_scale_, way_, vcm_, vc_;
  std::vector<std::uint32_t> slot_, pixel_seed_, index_, media_low_, media_high_, chain_;
};

/// Slots are below 2^15 (eight split paths of 64×64 pixels); above them there is room for the number of a light group.
inline constexpr int kGroupShift = 16;

/// Eight shadow rays and what they bring if nothing is in the way.
struct Shadow8 {
  V8 origin, direction;  ///< the light is at distance 1 in lengths of `direction`
  V8 contribution;
  U8 slot;            ///< with the light group's number from kGroupShift on, where lights are told apart
  Media8 media = {};  ///< at the origin; kept only where the scene has such
};

class ShadowQueue {
 public:
  void reserve(std::size_t n, bool with_media) {
    n += 8;
    with_media_ = with_media;
    if (with_media) {
      media_low_.resize(n);
      media_high_.resize(n);
    }
    origin_.resize(n);
    direction_.resize(n);
    contribution_.resize(n);
    slot_.resize(n);
  }
  int size() const { return size_; }
  void clear() { size_ = 0; }
  Shadow8 load(int i) const {
    return {origin_.load(i), direction_.load(i), contribution_.load(i), U8::load(&slot_[i]),
            with_media_ ? Media8{U8::load(&media_low_[i]), U8::load(&media_high_[i])} : Media8{}};
  }
  void push(M8 lanes, const Shadow8& s) {
    const int bits = lanes.bits();
    const U8 order = compress_order(bits);
    origin_.store(size_, permute(s.origin, order));
    direction_.store(size_, permute(s.direction, order));
    contribution_.store(size_, permute(s.contribution, order));
    lightmill::permute(s.slot, order).store(&slot_[size_]);
    if (with_media_) {
      lightmill::permute(s.media.low, order).store(&media_low_[size_]);
      lightmill::permute(s.media.high, order).store(&media_high_[size_]);
    }
    size_ += std::popcount(static_cast<unsigned>(bits));
  }

 private:
  int size_ = 0;
  bool with_media_ = false;
  VectorArray origin_, direction_, contribution_;
  std::vector<std::uint32_t> slot_, media_low_, media_high_;
};

}  // namespace lightmill::path

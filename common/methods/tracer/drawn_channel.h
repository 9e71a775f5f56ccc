// Sampling of one of three colour channels.
#pragma once

#include "common/math/vec.h"

namespace lightmill::tracer {

/// The value of a channel, drawn by `u` in proportion to the shares. Rounded shares may sum to less than 1. The rest
/// would draw the last channel even if its share is 0. So the largest channel replaces one whose share is below a
/// random number's last bit.
inline F8 drawn_channel(const V8& value, const V8& share, F8 u) {
  const M8 x = u < share.x, y = u < share.x + share.y;
  const F8 drawn = select(x, value.x, select(y, value.y, value.z));
  const F8 drawn_share = select(x, share.x, select(y, share.y, share.z));
  const M8 x_is_largest = ~(share.x < share.y) & ~(share.x < share.z);
  const F8 of_largest = select(x_is_largest, value.x, select(share.y < share.z, value.z, value.y));
  return select(drawn_share < F8(0x1p-24f), of_largest, drawn);
}

}  // namespace lightmill::tracer

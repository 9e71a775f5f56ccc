// The channel of a texture that a scalar map takes.
#pragma once

#include "common/materials/texture.h"
#include "common/scene/document.h"

namespace lightmill {

/// `channel`: of ScalarMap.
inline F8 channel_of(const Texture::Rgba8& texel, U8 channel) {
  using Channel = ScalarMap::Channel;
  const auto is = [&](Channel c) { return channel == U8(static_cast<std::uint32_t>(c)); };
  // Rec. 709
  F8 value = F8(0.2126f) * texel.rgb.x + F8(0.7152f) * texel.rgb.y + F8(0.0722f) * texel.rgb.z;
  value = select(is(Channel::r), texel.rgb.x, value);
  value = select(is(Channel::g), texel.rgb.y, value);
  value = select(is(Channel::b), texel.rgb.z, value);
  return select(is(Channel::alpha), texel.alpha, value);
}

}  // namespace lightmill

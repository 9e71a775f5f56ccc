// Cryptomatte: names visible in a pixel and their coverages, in float channels from which compositors make mattes.
// Psyop's specification 1.2.0 (Friedman and Jones 2015).
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/image/image.h"

namespace lightmill {

/// MurmurHash3_x86_32 (Appleby) of the bytes.
std::uint32_t murmur_hash3(std::string_view text, std::uint32_t seed = 0);

/// Identifier of a name: its hash as a float that is not NaN, infinite or denormal ("uint32_to_float32").
float cryptomatte_id(std::string_view name);

/// Number of names that a pixel holds. Names with the least coverage are dropped first.
inline constexpr std::size_t kCryptomatteRanks = 6;

/// Largest number of samples of a pixel.
inline constexpr std::size_t kMaxCryptomatteSamples = 16;

/// One pixel's ranks, largest coverage first, as alternating identifier and coverage, then zeros. `ids`: the identifier
/// of each sample, at most kMaxCryptomatteSamples; 0 for samples that hit nothing. Equal coverages keep the order of
/// the samples.
std::array<float, 2 * kCryptomatteRanks> cryptomatte_ranks(std::span<const float> ids);

/// Channels of a Cryptomatte layer, in the order of cryptomatte_ranks: LAYER00.R, .G, .B, .A, LAYER01.R …
std::vector<std::string> cryptomatte_channels(std::string_view layer);

/// Adds the layer's header attributes: name, hash, conversion, and the manifest of `names`.
void add_cryptomatte_attributes(std::map<std::string, ImageAttribute>& attributes, std::string_view layer,
                                const std::set<std::string>& names);

}  // namespace lightmill

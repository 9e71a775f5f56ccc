// Cryptomatte: which named things a pixel sees and how much of it each covers, in float channels that compositors pick
// mattes from. Psyop's specification 1.2.0 (Friedman and Jones 2015).
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

/// The identifier of a name: its hash as a float that is neither NaN, infinite nor denormal ("uint32_to_float32").
float cryptomatte_id(std::string_view name);

/// How many names a pixel can hold; those that cover least of it go first where there are more.
inline constexpr std::size_t kCryptomatteRanks = 6;

/// How many samples of a pixel can be told apart.
inline constexpr std::size_t kMaxCryptomatteSamples = 16;

/// One pixel's ranks, largest coverage first: identifier and coverage in turns, zeros where there are no more. `ids`
/// holds the identifier of each sample, 0 for those that see nothing, of at most kMaxCryptomatteSamples. Equal
/// coverages keep the order of the samples.
std::array<float, 2 * kCryptomatteRanks> cryptomatte_ranks(std::span<const float> ids);

/// The channels of a Cryptomatte layer, in the order of cryptomatte_ranks: LAYER00.R, .G, .B, .A, LAYER01.R …
std::vector<std::string> cryptomatte_channels(std::string_view layer);

/// Adds what the header must say of a layer: name, hash, conversion, and the manifest of `names`.
void add_cryptomatte_attributes(std::map<std::string, ImageAttribute>& attributes, std::string_view layer,
                                const std::set<std::string>& names);

}  // namespace lightmill

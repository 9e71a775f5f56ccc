#include "common/image/cryptomatte.h"

#include <algorithm>
#include <bit>

#include "common/base/check.h"
#include "common/base/text.h"

namespace lightmill {

std::uint32_t murmur_hash3(std::string_view text, std::uint32_t seed) {
  constexpr std::uint32_t kC1 = 0xcc9e2d51, kC2 = 0x1b873593;
  const auto byte = [&](std::size_t i) { return std::uint32_t{static_cast<std::uint8_t>(text[i])}; };
  std::uint32_t hash = seed;
  std::size_t at = 0;
  for (; at + 4 <= text.size(); at += 4) {
    const std::uint32_t block = byte(at) | byte(at + 1) << 8 | byte(at + 2) << 16 | byte(at + 3) << 24;
    hash = std::rotl(hash ^ (std::rotl(block * kC1, 15) * kC2), 13) * 5 + 0xe6546b64;
  }
  std::uint32_t tail = 0;
  for (std::size_t i = text.size(); i > at; --i) {
    tail = tail << 8 | byte(i - 1);
  }
  hash ^= std::rotl(tail * kC1, 15) * kC2;
  hash ^= static_cast<std::uint32_t>(text.size());
  hash = (hash ^ hash >> 16) * 0x85ebca6b;
  hash = (hash ^ hash >> 13) * 0xc2b2ae35;
  return hash ^ hash >> 16;
}

float cryptomatte_id(std::string_view name) {
  const std::uint32_t hash = murmur_hash3(name);
  const std::uint32_t exponent = std::clamp<std::uint32_t>(hash >> 23 & 0xff, 1, 254);
  return std::bit_cast<float>((hash & 0x807fffff) | exponent << 23);
}

std::array<float, 2 * kCryptomatteRanks> cryptomatte_ranks(std::span<const float> ids) {
  struct Rank {
    float id;
    std::uint32_t count;
  };
  LM_CHECK(ids.size() <= kMaxCryptomatteSamples, "{} samples", ids.size());
  std::array<Rank, kMaxCryptomatteSamples> ranks;
  std::size_t size = 0;
  for (const float id : ids) {
    if (id == 0) {
      continue;
    }
    Rank* const end = ranks.data() + size;
    Rank* const found = std::find_if(ranks.data(), end, [&](const Rank& rank) { return rank.id == id; });
    if (found == end) {
      ranks[size++] = {id, 1};
    } else {
      ++found->count;
    }
  }
  // A stable insertion sort, because there are only a few.
  for (std::size_t i = 1; i < size; ++i) {
    for (std::size_t k = i; k > 0 && ranks[k].count > ranks[k - 1].count; --k) {
      std::swap(ranks[k], ranks[k - 1]);
    }
  }
  std::array<float, 2 * kCryptomatteRanks> out{};
  for (std::size_t i = 0; i < std::min(size, kCryptomatteRanks); ++i) {
    out[2 * i] = ranks[i].id;
    out[2 * i + 1] = static_cast<float>(ranks[i].count) / static_cast<float>(ids.size());
  }
  return out;
}

std::vector<std::string> cryptomatte_channels(std::string_view layer) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < 2 * kCryptomatteRanks; ++i) {
    names.push_back(fmt::format("{}{:02}.{}", layer, i / 4, "RGBA"[i % 4]));
  }
  return names;
}

void add_cryptomatte_attributes(std::map<std::string, ImageAttribute>& attributes, std::string_view layer,
                                const std::set<std::string>& names) {
  const std::string prefix = fmt::format("cryptomatte/{:.7}/", fmt::format("{:08x}", murmur_hash3(layer)));
  std::string manifest = "{";
  for (const std::string& name : names) {
    manifest += fmt::format("{}{}:\"{:08x}\"", manifest.size() > 1 ? "," : "", json_text(name),
                            std::bit_cast<std::uint32_t>(cryptomatte_id(name)));
  }
  attributes[prefix + "name"] = std::string(layer);
  attributes[prefix + "hash"] = std::string("MurmurHash3_32");
  attributes[prefix + "conversion"] = std::string("uint32_to_float32");
  attributes[prefix + "manifest"] = manifest + "}";
}

}  // namespace lightmill

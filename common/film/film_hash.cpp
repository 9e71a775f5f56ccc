#include "common/film/film_hash.h"

#include <bit>

static_assert(std::endian::native == std::endian::little, "planes are hashed as little-endian bytes");

namespace lightmill {

Hash128 film_hash(const FilmPlanesView& planes) {
  Xxh3Hasher hasher;
  hasher.append(std::as_bytes(planes.mean_a));
  hasher.append(std::as_bytes(planes.mean_b));
  hasher.append(std::as_bytes(planes.counts));
  for (const std::span<const float> layer : planes.layers) {
    hasher.append(std::as_bytes(layer));
  }
  for (const Hash128& meter : planes.meters) {
    const std::array words{meter.low, meter.high};
    hasher.append(std::as_bytes(std::span(words)));
  }
  return hasher.finish();
}

Hash128 meter_hash(std::span<const float> sums, std::uint64_t samples_a, std::uint64_t samples_b) {
  Xxh3Hasher hasher;
  const std::array counts{samples_a, samples_b};
  hasher.append(std::as_bytes(std::span(counts)));
  hasher.append(std::as_bytes(sums));
  return hasher.finish();
}

}  // namespace lightmill

// The merge map, compared with a search through all photons.
#include "common/methods/vcm/merge_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace lightmill::vcm {
namespace {

constexpr Vec3 kEye{3, -2, 1};

/// Points whose distances from the camera spread evenly over the octaves from 2^-9 to 2^9. Many are in clusters.
class Points {
 public:
  explicit Points(std::uint32_t seed) : engine_(seed) {}
  float number() { return static_cast<float>(engine_() >> 8) * 0x1p-24f; }
  Vec3 direction() {
    const float z = 2 * number() - 1, turn = 6.2831853f * number(), r = std::sqrt(1 - z * z);
    return {r * std::cos(turn), r * std::sin(turn), z};
  }
  Vec3 anywhere() { return kEye + direction() * std::exp2(18 * number() - 9); }

 private:
  std::mt19937 engine_;
};

std::vector<std::uint32_t> tried_all(const std::vector<photons::Photon>& photons, const Vec3& p, float radius) {
  std::vector<std::uint32_t> near;
  for (std::uint32_t i = 0; i < photons.size(); ++i) {
    const Vec3 d = photons[i].point - p;
    if (glm::dot(d, d) < radius * radius) {
      near.push_back(i);
    }
  }
  return near;
}

struct Found {
  std::size_t photons = 0, octaves = 0;  ///< found in all; octaves of radii with any photon found
};

/// Compares searches around places near photons. Some places are just within reach of one.
Found compare(const MergeRadii& radii, std::uint32_t seed) {
  constexpr int kPhotons = 3000, kSearches = 2000;
  Points points(seed);
  std::vector<photons::Photon> photons(kPhotons);
  for (std::size_t i = 0; i < kPhotons; ++i) {
    const Vec3 middle = i % 2 == 0 ? points.anywhere() : photons[i - 1].point;
    photons[i].point = i % 2 == 0 ? middle : middle + points.direction() * (2 * points.number() * radii.at(middle));
  }
  const MergeMap map(photons, radii);
  EXPECT_FALSE(map.empty());
  Found found;
  std::vector<bool> octaves(64);
  for (int i = 0; i < kSearches; ++i) {
    const Vec3 near = photons[static_cast<std::size_t>(i) % kPhotons].point;
    const float reach = i % 3 == 0 ? 0.999f / (1 + radii.per_length) : 1.5f * points.number();
    const Vec3 p = near + points.direction() * (reach * radii.at(near));
    const float radius = radii.at(p);
    std::vector<std::uint32_t> numbers;
    map.find(p, radius, numbers);
    std::ranges::sort(numbers);
    EXPECT_EQ(numbers, tried_all(photons, p, radius)) << "search " << i << ", radius " << radius;
    found.photons += numbers.size();
    octaves[static_cast<std::size_t>(std::ilogb(radius) + 32)] =
        octaves[static_cast<std::size_t>(std::ilogb(radius) + 32)] || !numbers.empty();
  }
  found.octaves = static_cast<std::size_t>(std::ranges::count(octaves, true));
  return found;
}

TEST(MergeMap, MatchesBruteForceOverManyOctavesOfRadii) {
  for (const float per_length : {0.001f, 0.02f, 0.2f, 0.34f, 0.6f}) {
    const Found found = compare({kEye, per_length, per_length / 256, 8 * per_length}, 1);
    EXPECT_GT(found.photons, 1000u) << per_length;
    EXPECT_GT(found.octaves, 8u) << per_length;
  }
}

TEST(MergeMap, MatchesBruteForceWhenRadiiGrowFasterThanDistance) {
  for (const float per_length : {0.99f, 1.0f, 3.0f}) {
    EXPECT_GT(compare({kEye, per_length, per_length / 256, 8 * per_length}, 2).photons, 1000u) << per_length;
  }
}

TEST(MergeMap, MatchesBruteForceWithOneRadius) {
  EXPECT_GT(compare({kEye, 0.5f, 0.1f, 0.1f}, 3).photons, 1000u);
}

TEST(MergeMap, StoresAPhotonTwiceAtMost) {
  Points points(4);
  std::vector<photons::Photon> photons(1 << 14);
  for (photons::Photon& photon : photons) {
    photon.point = points.anywhere();
  }
  for (const float per_length : {0.001f, 0.2f, 0.5f, 0.9f, 2.0f}) {
    const MergeMap map(photons, {kEye, per_length, per_length / 256, 8 * per_length});
    // An entry and its share of the buckets take at most 24 + 16 bytes. Each of the maps takes less than 1 KiB besides.
    EXPECT_LE(map.bytes(), photons.size() * 2 * 40 + (16 << 10)) << per_length;
  }
}

TEST(MergeMap, FindsNothingWithoutPhotons) {
  std::vector<std::uint32_t> found;
  MergeMap({}, {kEye, 0.1f, 0.001f, 1}).find(kEye, 0.5f, found);
  EXPECT_TRUE(found.empty());
}

}  // namespace
}  // namespace lightmill::vcm

// Memory of the light table, and lights at the ends of their ranges.
#include "common/lights/light_table.h"

#include <gtest/gtest.h>

#include "tests/support/lanes.h"

namespace lightmill {
namespace {

TEST(LightTable, CountsTheRowsOfAllLights) {
  const auto bytes_with = [](const auto& add) {
    LightTable lights;
    add(lights);
    lights.build();
    return lights.bytes();
  };
  // Three points and a radiance in single precision for each facet. A tree has up to two nodes for each.
  const std::uint64_t facets = bytes_with([](LightTable& lights) {
    for (int i = 0; i < 10; ++i) {
      lights.facets.add({Vec3(0), {1, 0, 0}, {0, 1, 0}, Vec3(1)});
    }
  });
  EXPECT_GE(facets, 10u * 4 * 12);
  EXPECT_LE(facets, 10u * 300);
  const std::uint64_t profile = bytes_with([](LightTable& lights) {
    const IesProfile flat{{0, 90}, {0, 180, 360}, {1, 1, 1, 1, 1, 1}};
    IesProfile fine{{}, {0, 360}, std::vector<double>(2000, 1.0)};
    for (int i = 0; i < 1000; ++i) {
      fine.vertical.push_back(0.1 * i);
    }
    lights.ies.add_profile(flat);
    lights.ies.add({Vec3(0), {0, -1, 0}, {1, 0, 0}, Vec3(1), lights.ies.add_profile(fine)});
  });
  EXPECT_GE(profile, 4u * (2 + 3 + 6 + 1000 + 2 + 2000));
  EXPECT_LE(profile, 4u * (2 + 3 + 6 + 1000 + 2 + 2000) + 200);
}

TEST(SpotLights, ASpotOfAllDirectionsAlsoShinesBackwards) {
  SpotLights spots;
  spots.add({{0, 2, 0}, {0, 1, 0}, Vec3(4), 2, 2});
  for (const float aside : {0.0f, 1e-6f, 1e-5f, 1e-4f, 1e-3f, 1e-2f}) {
    const V8 direction = normalize(broadcast(Vec3(aside, -1, aside)));
    EXPECT_EQ(test::Lanes(spots.intensity(direction, U8(0u), first_lanes(1)).x)[0], 4) << aside;
  }
}

}  // namespace
}  // namespace lightmill

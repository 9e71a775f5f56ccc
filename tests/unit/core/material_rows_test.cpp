#include "common/scene/compiled/material_rows.h"

#include <gtest/gtest.h>

#include "common/scene/compiled/material_table.h"
#include "tests/support/lanes.h"

namespace lightmill {
namespace {

std::shared_ptr<const Material> part(float reflectance) {
  Material out;
  out.kind = DiffuseMaterial{{reflectance, reflectance, reflectance}};
  out.single_scattering = reflectance > 0.5f;
  return std::make_shared<const Material>(out);
}

TEST(MaterialRows, PartsFollowTheMaterialsAndHaveTheSurfaceOfTheirMixture) {
  Material inner;
  inner.kind = MixtureMaterial{part(0.25f), part(0.75f), 0.5, {}};
  Scene scene;
  scene.materials.emplace_back().name = "plain";
  Material& outer = scene.materials.emplace_back();
  outer.name = "outer";
  outer.emission = {1, 2, 3};
  outer.opacity.mode = Opacity::Mode::blend;
  outer.kind = MixtureMaterial{std::make_shared<const Material>(inner), part(1), 0.5, {}};
  const MaterialRows rows = material_rows(scene);
  ASSERT_EQ(rows.materials.size(), 6u);
  EXPECT_EQ(rows.owners, (std::vector<std::uint32_t>{0, 1, 1, 1, 1, 1}));
  EXPECT_EQ(rows.parts[1], (std::array<std::uint32_t, 2>{2, 3}));
  EXPECT_EQ(rows.parts[2], (std::array<std::uint32_t, 2>{4, 5}));
  for (const std::size_t i : {3, 4, 5}) {
    const Material& row = *rows.materials[i];
    EXPECT_TRUE(std::holds_alternative<DiffuseMaterial>(row.kind)) << i;
    EXPECT_EQ(row.emission, (TexturedColor{1, 2, 3})) << i;
    EXPECT_EQ(row.opacity.mode, Opacity::Mode::blend) << i;
    EXPECT_EQ(row.single_scattering, std::get<DiffuseMaterial>(row.kind).reflectance.rgb.r > 0.5f) << i;
  }
}

TEST(MaterialRows, PartsHaveTheirOwnAnisotropy) {
  Material brushed;
  brushed.kind = ConductorMaterial{{1, 1, 1}, {2, 2, 2}, 0.5, {0.75, 0}};
  Scene scene;
  scene.materials.emplace_back().kind = MixtureMaterial{std::make_shared<const Material>(brushed), part(0.5f), 0.5, {}};
  const MaterialRows rows = material_rows(scene);
  const MaterialTable table(scene, rows, {}, std::vector<Vec3>(1));
  Surface8 surface{};
  surface.material = U8(1u);
  surface.directed = M8(true);
  const float along = test::Lanes(table.conductor(surface, M8(true)).facets.alpha())[0];
  surface.directed = M8();
  EXPECT_NE(along, test::Lanes(table.conductor(surface, M8(true)).facets.alpha())[0]);
}

}  // namespace
}  // namespace lightmill

#include "common/scene/casters.h"

#include <gtest/gtest.h>

#include "common/planner/narrow_lobes.h"
#include "tests/unit/planner/planner_scenes.h"

namespace lightmill {
namespace {

TEST(Casters, AreMirrorsGlassAndMetalWithNarrowLobes) {
  const double edge = std::sqrt(kCasterAlpha);
  EXPECT_TRUE(is_caster(kMirror));
  EXPECT_TRUE(is_caster(kGlass));
  EXPECT_TRUE(is_caster(rough_glass(edge * 0.99)));
  EXPECT_FALSE(is_caster(rough_glass(edge * 1.01)));
  EXPECT_TRUE(is_caster(metal(0)));
  EXPECT_TRUE(is_caster(metal(edge * 0.99)));
  EXPECT_FALSE(is_caster(metal(edge * 1.01)));
  EXPECT_FALSE(is_caster(kWhite));
  EXPECT_FALSE(is_caster(material("phong", PhongMaterial{{0, 0, 0}, {1, 1, 1}, 1e6})));
  EXPECT_FALSE(is_caster(material("shadow_catcher", ShadowCatcherMaterial{})));
  EXPECT_EQ(narrow_lobes(material("black mirror", MirrorMaterial{{0, 0, 0}})), NarrowLobes::none);
}

TEST(Casters, APrincipledMaterialIsACasterWithoutWideLobes) {
  PrincipledMaterial made;
  made.roughness = 0.1;
  made.metallic = 1;
  EXPECT_TRUE(is_caster(material("m", made)));
  made.metallic = 0.99;
  EXPECT_FALSE(is_caster(material("m", made))) << "a diffuse part";
  made.transmission = 1;
  EXPECT_TRUE(is_caster(material("m", made)));
  made.coat = 0.5;
  EXPECT_TRUE(is_caster(material("m", made)));
  made.coat_roughness = 0.5;
  EXPECT_FALSE(is_caster(material("m", made))) << "a wide coat";
  made = {};
  made.metallic = 1;
  made.roughness = 0.1;
  Material mapped = material("m", made);
  mapped.roughness_map.texture = 0;
  EXPECT_TRUE(is_caster(mapped)) << "maps only make smoother";
  mapped.metallic_map.texture = 0;
  EXPECT_FALSE(is_caster(mapped)) << "not metal everywhere";
}

TEST(Casters, MapsOfLayersCanLeaveNoneOfThem) {
  PrincipledMaterial made;
  made.roughness = 0.01;
  made.transmission = 1;
  EXPECT_TRUE(is_caster(material("m", made)));
  EXPECT_EQ(narrow_lobes(material("m", made)), NarrowLobes::all);
  made.transmission_map.texture = 0;
  EXPECT_FALSE(is_caster(material("m", made))) << "plastic where the map is 0";
  EXPECT_EQ(narrow_lobes(material("m", made)), NarrowLobes::some);
  EXPECT_TRUE(receives_light(material("m", made)));
  made = {};
  made.metallic = 1;
  made.roughness = 0.1;
  made.coat = 1;
  made.coat_roughness = 0.2;
  made.coat_roughness_map.texture = 0;
  const std::vector<CasterLobe> lobes = caster_lobes(material("m", made));
  ASSERT_EQ(lobes.size(), 2u);
  EXPECT_GT(lobes[0].alpha, 0);
  EXPECT_EQ(lobes[1].alpha, 0) << "smooth where the map is 0";
}

TEST(Casters, AnisotropicMetalCountsWithItsMeanAlpha) {
  // √(0.01 · (0.01 + 0.99 s²)) is 0.1 for s = 1.
  ConductorMaterial brushed;
  brushed.roughness = 0.1;
  brushed.anisotropy.strength = 0.9;
  EXPECT_TRUE(is_caster(material("m", brushed)));
  brushed.roughness = 0.11;
  brushed.anisotropy.strength = 1;
  EXPECT_FALSE(is_caster(material("m", brushed)));
  // Not smooth: it has a density.
  brushed.roughness = 0;
  EXPECT_TRUE(receives_light(material("m", brushed)));
  EXPECT_EQ(narrow_lobes(material("m", brushed)), NarrowLobes::none);
  brushed.anisotropy.strength = 0.1;
  EXPECT_EQ(narrow_lobes(material("m", brushed)), NarrowLobes::all);
}

TEST(Casters, SheenScattersToAllSides) {
  PrincipledMaterial made;
  made.metallic = 1;
  made.roughness = 0.01;
  made.sheen_color = {0, 0.1f, 0};
  EXPECT_FALSE(is_caster(material("m", made)));
  EXPECT_EQ(narrow_lobes(material("m", made)), NarrowLobes::some);
  made.metallic = 0;
  made.transmission = 1;
  EXPECT_TRUE(is_caster(material("m", made))) << "glass has no sheen";
  EXPECT_EQ(narrow_lobes(material("m", made)), NarrowLobes::all);
}

TEST(NarrowLobes, AreTheSharpPartOfAMaterial) {
  const double edge = std::sqrt(kNarrowAlpha);
  EXPECT_EQ(narrow_lobes(kMirror), NarrowLobes::all);
  EXPECT_EQ(narrow_lobes(rough_glass(0.99 * edge)), NarrowLobes::all);
  EXPECT_EQ(narrow_lobes(rough_glass(1.01 * edge)), NarrowLobes::none);
  EXPECT_EQ(narrow_lobes(lacquer(0.99 * edge)), NarrowLobes::some);
  EXPECT_EQ(narrow_lobes(lacquer(0.5)), NarrowLobes::none);
  EXPECT_EQ(narrow_lobes(kWhite), NarrowLobes::none);
  EXPECT_EQ(narrow_lobes(phong(0, 1e6)), NarrowLobes::all);
  EXPECT_EQ(narrow_lobes(phong(0.5, 1e6)), NarrowLobes::some);
  EXPECT_EQ(narrow_lobes(phong(0, 1e5)), NarrowLobes::none);
  EXPECT_TRUE(receives_light(kWhite));
  EXPECT_TRUE(receives_light(rough_glass(0.3)));
  EXPECT_TRUE(receives_light(rough_glass(0.0101))) << "its lobes have a density";
  EXPECT_TRUE(receives_light(phong(0, 1e6)));
  EXPECT_FALSE(receives_light(kGlass));
  EXPECT_FALSE(receives_light(kBlack));
  EXPECT_FALSE(receives_light(material("shadow_catcher", ShadowCatcherMaterial{})));
}

TEST(Casters, AMixtureIsOneIfAPartIsOne) {
  const auto mixed = [](const Material& first, const Material& second, double factor) {
    const auto part = [](const Material& m) { return std::make_shared<const Material>(m); };
    return material("mixture", MixtureMaterial{part(first), part(second), factor});
  };
  EXPECT_TRUE(is_caster(mixed(kWhite, kMirror, 0.25)));
  EXPECT_FALSE(is_caster(mixed(kWhite, metal(0.9), 0.25)));
  EXPECT_EQ(narrow_lobes(mixed(kWhite, kMirror, 0.25)), NarrowLobes::some);
  EXPECT_EQ(narrow_lobes(mixed(metal(0), kMirror, 0.25)), NarrowLobes::all);
  EXPECT_TRUE(receives_light(mixed(kMirror, kWhite, 0.25)));
  EXPECT_FALSE(receives_light(mixed(kMirror, metal(0), 0.25)));
  const std::vector<CasterLobe> one = caster_lobes(mixed(kWhite, mixed(kMirror, kWhite, 0.5), 0.25));
  ASSERT_EQ(one.size(), 1u);
  EXPECT_EQ(one[0].share, 1);
  const std::vector<CasterLobe> two = caster_lobes(mixed(kMirror, metal(0.2), 0.25));
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0].share, 0.75);
  EXPECT_EQ(two[1].share, 0.25);
  EXPECT_GT(two[1].alpha, 0);
}

}  // namespace
}  // namespace lightmill

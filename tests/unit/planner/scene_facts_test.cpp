#include "common/planner/scene_facts.h"

#include <gtest/gtest.h>

#include "common/planner/regions.h"
#include "tests/unit/planner/planner_scenes.h"

namespace lightmill {
namespace {

TEST(Facts, TheFirstOfManyItemsAreNamedAndTheRestAreCounted) {
  std::vector<Material> many;
  for (int i = 0; i < 40; ++i) {
    many.push_back(material(fmt::format("glass {}", i), DielectricMaterial{}));
  }
  const SceneFacts facts = read_facts(scene_of(many, {kSky}));
  EXPECT_EQ(facts.casters.count, 40u);
  EXPECT_EQ(facts.casters.names.size(), NamedItems::kMaxNames);
  EXPECT_NE(facts.casters.text().find("and 32 more"), std::string::npos) << facts.casters.text();
}

TEST(Facts, FeaturesAreThoseOfTheScene) {
  EXPECT_EQ(features_of(read_facts(scene_of({kWhite}, {kBulb}))), std::vector<std::string>{"light sampling"});
  Material amber = kGlass;
  amber.interior.absorption = {0, 1, 2};
  Scene scene = scene_of({amber, emitter()}, {kSky});
  scene.camera.lens_radius = 1;
  EXPECT_EQ(features_of(read_facts(scene)),
            (std::vector<std::string>{"light sampling", "emissive surfaces", "constant environment", "media",
                                      "absorption", "lens"}));
  Scene bumpy = scene_of({kWhite}, {kBulb});
  bumpy.textures = {{"bumps", "bumps.png", {}}};
  bumpy.materials[0].bump_map.map.texture = 0;
  EXPECT_EQ(features_of(read_facts(bumpy)), (std::vector<std::string>{"light sampling", "textures", "normal maps"}));
  const auto leaf = std::make_shared<const Material>(material("leaf", DiffuseMaterial{{0, 0, 0}, 0, {0, 0.5f, 0}}));
  EXPECT_EQ(features_of(read_facts(scene_of({material("worn", MixtureMaterial{leaf, leaf})}, {kBulb}))),
            (std::vector<std::string>{"light sampling", "mixtures", "sheets that transmit light"}));
  PrincipledMaterial cloth;
  cloth.anisotropy.strength = 0.5;
  cloth.sheen_color = {0, 0, 0.5f};
  EXPECT_EQ(features_of(read_facts(scene_of({material("cloth", cloth)}, {kBulb}))),
            (std::vector<std::string>{"light sampling", "anisotropy", "sheen"}));
  PrincipledMaterial petal;
  petal.transmittance = {0, 0.5f, 0};
  EXPECT_EQ(features_of(read_facts(scene_of({material("petal", petal)}, {kBulb}))),
            (std::vector<std::string>{"light sampling", "sheets that transmit light"}));
  petal.metallic = 1;
  EXPECT_EQ(features_of(read_facts(scene_of({material("petal", petal)}, {kBulb}))),
            std::vector<std::string>{"light sampling"});
}

TEST(Facts, BodiesWithAHighlightScatterLightAndDoNotChangeTheIndex) {
  PrincipledMaterial skin{{0, 0, 0}};
  skin.transmittance = {1, 1, 1};
  Material body = material("skin", skin);
  body.interior.scattering = {1, 1, 1};
  Material fog = material("fog", DielectricMaterial{1});
  const SceneFacts facts = read_facts(scene_of({body, fog}, {kSky}));
  EXPECT_TRUE(facts.scattering);
  EXPECT_TRUE(facts.receivers);
  EXPECT_EQ(facts.boundaries, 2u);
  EXPECT_TRUE(facts.casters.empty()) << "fog of index 1 affects no light where no index changes";
  EXPECT_TRUE(facts.lossless) << "what the black base does not reflect passes through it";
}

TEST(Facts, MaterialsThatRaysPassAreNamed) {
  Material gauze = material("gauze", DiffuseMaterial{}), leaf = gauze, whole = gauze;
  gauze.opacity = {Opacity::Mode::blend, 0.5};
  leaf.name = "leaf";
  whole.name = "whole";
  leaf.opacity = {Opacity::Mode::mask, 1, {0}};
  leaf.emission = {1, 1, 1};
  whole.opacity = {Opacity::Mode::mask, 0.5, {}, 0.5};
  const SceneFacts facts = read_facts(scene_of({gauze, leaf, whole}, {kSky}));
  EXPECT_EQ(facts.see_through.text(), "the material 'gauze' and the material 'leaf'");
  EXPECT_EQ(facts.unsampled_emitters.count, 1u);  // the leaf
  const std::vector<std::string> features = features_of(facts);
  EXPECT_NE(std::ranges::find(features, "opacity"), features.end());
  EXPECT_TRUE(read_facts(scene_of({whole}, {kSky})).see_through.empty());
}

TEST(Facts, ASceneThatLosesNoLightIsFlagged) {
  const Material snow = material("snow", DiffuseMaterial{{1, 0.9f, 0.9f}});
  EXPECT_TRUE(read_facts(scene_of({snow, kMirror, kGlass}, {kSky})).lossless) << "red light is never absorbed";
  EXPECT_FALSE(read_facts(scene_of({snow, kWhite}, {kSky})).lossless);
  Material amber = kGlass;
  amber.interior.absorption = {1, 0, 0};
  EXPECT_FALSE(read_facts(scene_of({snow, amber}, {kSky})).lossless);
  EXPECT_EQ(read_facts(scene_of({snow, kWhite}, {kSky})).largest_albedo, 1);
  Material chalk = material("chalk", DiffuseMaterial{{1, 1, 1}, 0.8});
  EXPECT_TRUE(read_facts(scene_of({chalk}, {kSky})).lossless);
  chalk.single_scattering = true;
  EXPECT_FALSE(read_facts(scene_of({chalk}, {kSky})).lossless);
}

TEST(Facts, GlossOnBurleysDiffusePartAddsToItsAlbedo) {
  // Gray of 0.95 reflects 0.95 · 1.0652 of uniform light without gloss (the mean of principled_test's formula, roughness 1).
  PrincipledMaterial chalk{{0.95f, 0.95f, 0.95f}, 0, 1, 0};
  const auto most = [&] { return read_facts(scene_of({material("chalk", chalk)}, {kSky})).largest_albedo; };
  EXPECT_NEAR(most(), 0.95, 1e-6);
  chalk.burley_diffuse = true;
  EXPECT_GT(most(), 0.95 * 1.0652);
  const double matt = most();
  chalk.specular = 0.5;
  EXPECT_NEAR(most(), matt + 0.0917780, 1e-4);  // the mean reflectance of index 1.5
}

TEST(Facts, SheenRaisesDarkBasesAndKeepsWhiteOnes) {
  PrincipledMaterial cloth{{0.1f, 0.1f, 0.1f}};
  cloth.sheen_color = {1, 1, 1};
  const auto most = [&] { return read_facts(scene_of({material("cloth", cloth)}, {kSky})).largest_albedo; };
  EXPECT_NEAR(most(), 0.3 + 0.7 * 0.1, 1e-6);  // of even light, at roughness 1
  cloth.base_color = {1, 1, 1};
  EXPECT_NEAR(most(), 1, 1e-6);
}

/// Small lights over a plain of mirror balls.
Scene lights_over_mirrors(int lights, int balls) {
  Scene scene = scene_of({kMirror}, {});
  scene.objects.assign(static_cast<std::size_t>(balls), {"ball", 0, SphereShape{{0, 0, 0}, 1}});
  for (int i = 0; i < lights; ++i) {
    scene.lights.push_back({"bulb", PointLight{{0, 100, 0}, {1, 1, 1}, 1e-3}});
  }
  return scene;
}

TEST(Facts, TheWorkOfFindingSmallLightsHasALimit) {
  const SceneFacts few = read_facts(lights_over_mirrors(100, 100));
  EXPECT_EQ(few.small_emitters.count, 100u);
  EXPECT_EQ(few.steps, 100u * 100u);
  const SceneFacts many = read_facts(lights_over_mirrors(5'000, 5'000));
  EXPECT_EQ(many.small_emitters.count, Positions::kMaxSteps / 5'000) << "the others are not known to be small";
  EXPECT_EQ(many.sized_lights, 5'000u);
  EXPECT_LE(many.steps, Positions::kMaxSteps);
}

TEST(Facts, AMeshIsReadOnceAndItsUsesCountAsWork) {
  const Sha256 asset = sha256(as_byte_view("tile"));
  Mesh tiles{{{0, 0, 0}, {1, 0, 0}, {0, 0, 1}}, {}, {}, {}, {}};
  tiles.triangles.assign(5'000, {0, 1, 2});
  const std::string bytes = encode_mesh(tiles);
  int reads = 0;
  const MeshSource meshes{[&](const Sha256&) {
    ++reads;
    return std::optional(bytes);
  }};
  Scene scene = lights_over_mirrors(1, 3);
  for (Object& object : scene.objects) {
    object.shape = MeshShape{"tile.obj", asset};
  }
  const std::uint64_t once = bytes.size() / 2 + 3 * (3 * 5'000) + 3;  // one reading, three uses and comparisons
  const SceneFacts facts = read_facts(scene, meshes);
  EXPECT_EQ(reads, 1);
  EXPECT_NEAR(static_cast<double>(facts.steps), static_cast<double>(once), 1);
  EXPECT_EQ(facts.small_emitters.count, 1u);

  scene.objects.resize(2'000, scene.objects.front());  // 30 million steps
  const SceneFacts too_many = read_facts(scene, meshes);
  EXPECT_EQ(reads, 2);
  EXPECT_LE(too_many.steps, Positions::kMaxSteps);
  EXPECT_EQ(too_many.small_emitters.count, 0u) << "some positions are unknown";
}

}  // namespace
}  // namespace lightmill

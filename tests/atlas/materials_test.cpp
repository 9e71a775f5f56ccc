// The failure atlas for materials and media: extreme parameters and difficult arrangements, each with its right
// outcome.
#include <cmath>

#include "tests/atlas/atlas.h"
#include "tests/atlas/cases/material_scenes.h"

namespace lightmill::test {
namespace {

Estimate mirrored_emitter(const std::string& kind, std::uint64_t seed) {
  return mean_of(scene_of(emitter_in_a_floor(kind, 0)).render({"path", seed, 0}, 10), 0);
}

TEST(Materials, AreMirrorsAsRoughnessFallsToZero) {
  // F of glass at 45°, and 1 for white metal, on both sides of the limit below which a surface counts as smooth.
  for (const double roughness : {0.0, 1e-30, 1e-4, 0.0099, 0.0101, 0.02, 0.05}) {
    const struct {
      std::string kind;
      double exact;
    } cases[] = {
        {fmt::format(R"("dielectric": {{"roughness": {}}})", roughness), 0.0502399},
        {fmt::format(R"("conductor": {{"eta": {}, "k": {}, "roughness": {}}})", gray(1), gray(1000), roughness), 1},
        {fmt::format(R"("principled": {{"base_color": {}, "metallic": 1, "roughness": {}}})", gray(1), roughness), 1}};
    for (const auto& c : cases) {
      const Estimate seen = mirrored_emitter(c.kind, 50);
      EXPECT_NEAR(seen.value, c.exact, 5 * seen.standard_error + 2e-3 * c.exact) << c.kind;
      EXPECT_LT(seen.standard_error, 0.02 * c.exact) << c.kind;
    }
  }
}

TEST(Materials, PhongBecomesAMirrorAtExponentAMillion) {
  for (const double exponent : {1e4, 1e5, 1e6}) {
    const Estimate seen =
        mirrored_emitter(fmt::format(R"("phong": {{"specular": {}, "exponent": {}}})", gray(0.8), exponent), 51);
    // (s + 2)/(s + 1) times the mean cosine about 45°, over cos 45°: within 2/s of ρ cos θ, Phong's own loss.
    EXPECT_NEAR(seen.value, 0.8 * std::cos(M_PI / 4), 5 * seen.standard_error + 2e-3) << exponent;
  }
}

TEST(Materials, StayFiniteAtGrazingAngles) {
  const std::string kinds[] = {
      R"("phong": {"diffuse": {"rgb": [0.5, 0.5, 0.5]}, "specular": {"rgb": [0.5, 0.5, 0.5]}, "exponent": 1e6})",
      R"("phong": {"specular": {"rgb": [1, 1, 1]}, "exponent": 0})",
      R"("conductor": {"metal": "silver", "roughness": 1})",
      R"("conductor": {"metal": "silver", "roughness": 0.02})",
      R"("dielectric": {"roughness": 1})",
      R"("dielectric": {"ior": 10, "roughness": 0.02})",
      R"("dielectric": {"ior": 1e-3, "roughness": 0.5})",
      R"("principled": {"transmission": 0.5, "coat": 1, "coat_roughness": 1, "roughness": 0})",
      R"("principled": {"base_color": {"rgb": [0, 0, 0]}, "specular": 0})",
      R"("conductor": {"metal": "silver", "roughness": 0, "anisotropy": 1})",
      R"("principled": {"metallic": 1, "roughness": 0.02, "anisotropy": 0.1})",
      R"("principled": {"roughness": 0, "anisotropy": 0.5, "sheen_color": {"rgb": [1, 1, 1]}, "sheen_roughness": 0})",
      R"("principled": {"roughness": 0, "specular": 1, "ior": 10, "transmittance": {"rgb": [1, 1, 1]}})",
      R"("principled": {"coat": 1, "coat_roughness": 1, "sheen_color": {"rgb": [1, 1, 1]}, "transmittance": {"rgb": [1, 1, 1]}})",
      R"("principled": {"specular": 1, "ior": 5.83, "transmittance": {"rgb": [1, 1, 1]}}, "interior": {"absorption": {"rgb": [0, 1, 2]}})"};
  for (const std::string& kind : kinds) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 1e-4, 3], "look_at": [0, 0, 0])", 20, 16, diffuse("sky", 0, 1) + "," + named("x", kind),
                 sphere("sky", "[0, 0, 0]", 20, true) + "," + mesh("x", "floor.obj") + "," +
                     sphere("x", "[0, 0.3, 0]", 0.2)),
        {{"floor.obj",
          "v -8 0 -11\nv -8 0 9\nv 12 0 9\nv 12 0 -11\nvt 0 0\nvt 0 1\nvt 1 1\nvt 1 0\n"
          "f 1/1 2/2 3/3 4/4\n"}});
    const Estimate seen = mean_of(scene.render({"path", 52, 0}, 6), 1);
    EXPECT_TRUE(std::isfinite(seen.value)) << kind;
    EXPECT_GE(seen.value, 0) << kind;
    EXPECT_LE(seen.value, 110) << kind;  // n² of the densest glass, and noise
  }
}

TEST(Materials, APrincipledSurfaceWithFullGlossAddsNoEnergy) {
  // Normal reflectance reaches 1 at an index of 5.83 with twice the gloss. Nothing remains for the layers below.
  for (const double ior : {5.8, 5.9, 10.0}) {
    for (const double roughness : {0.0, 0.3, 1.0}) {
      const auto scene = TestScene::from_text(document(
          R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 20, 16,
          diffuse("sky", 0, 1) + "," +
              named("x", fmt::format(R"("principled": {{"base_color": {}, "specular": 1, "ior": {}, "roughness": {}}})",
                                     gray(1), ior, roughness)),
          sphere("sky", "[0, 0, 0]", 20, true) + "," + sphere("x", "[0, 0, 0]", 1)));
      const Estimate seen = mean_of(scene.render({"path", 53, 0}, 6), 1);
      // Light that facets scatter twice is lost, and more of it at higher roughness.
      EXPECT_LE(seen.value, 1 + 5 * seen.standard_error + 1e-4) << ior << ' ' << roughness;
      EXPECT_GE(seen.value, roughness == 0 ? 0.99 : 0.5) << ior << ' ' << roughness;
    }
  }
}

TEST(Materials, AnIndexOfOneIsInvisibleAtAnyRoughness) {
  for (const std::string kind :
       {R"("dielectric": {"ior": 1, "roughness": 0})", R"("dielectric": {"ior": 1, "roughness": 1})",
        R"("principled": {"base_color": {"rgb": [1, 1, 1]}, "transmission": 1, "ior": 1})"}) {
    const auto scene = TestScene::from_text(
        document(R"("eye": [0, 0, 3], "look_at": [0, 0, 0])", 30, 16,
                 R"({"name": "sky", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [1, 1, 1]}})"
                 "," +
                     named("air", kind),
                 sphere("sky", "[0, 0, 0]", 20, true) + "," + sphere("air", "[0, 0, 0]", 0.8)));
    EXPECT_NEAR(mean_of(scene.render({"path", 53, 0}, 4), 0).value, 1, 1e-4) << kind;
  }
}

TEST(Materials, ALightPipeReflectsAHundredTimes) {
  const Estimate seen = mean_of(scene_of(light_pipe()).render({"path", 54, 0}, 8), 0);
  EXPECT_NEAR(seen.value, 2.25, 5 * seen.standard_error + 0.01);
  EXPECT_LT(seen.standard_error, 0.05);
}

TEST(Materials, AMirrorCorridorIsSeenToItsEnd) {
  for (const auto& [share, reflections] : {std::pair(1.0, 120), {0.99, 100}, {0.5, 5}}) {
    const AtlasCase corridor = mirror_corridor(share, reflections);
    const TestScene scene = scene_of(corridor);
    SCOPED_TRACE(reflections);
    expect_answer(mean_of(clean_picture(scene, "path", 10), 0), *corridor.exact, 2e-2);
    EXPECT_NEAR(mean_of(clean_picture(scene, "whitted", 1), 0).value, *corridor.exact, 5e-5 * *corridor.exact);
  }
}

TEST(Materials, VeachsPlatesShowLightsOfAllSizesAtAllRoughnesses) {
  // Light sampling finds the small lights. In smooth plates only reflection finds the large ones.
  for (const double roughness : {0.1, 0.25, 0.5, 0.8}) {
    for (const double radius : {0.02, 0.1, 0.4, 0.9}) {
      for (const double aside : {0.3, 1.0}) {
        const AtlasCase plate = emitter_over_a_plate(roughness, radius, aside);
        SCOPED_TRACE(plate.name);
        expect_answer(mean_of(clean_picture(scene_of(plate), "path", 9, 1), 0), *plate.exact, 1e-2);
      }
    }
  }
}

TEST(Materials, ACausticIsSeenInAMirrorAsOnItsWall) {
  // A light and its image in a mirror floor light a white wall. The mirror shows the same wall, also at its edge to the
  // floor.
  const double radius = 0.3;
  for (const double y : {0.01, 0.25, 1.0}) {
    const double irradiance =
        M_PI * (1 / std::pow(1 + (1 - y) * (1 - y), 1.5) + 1 / std::pow(1 + (1 + y) * (1 + y), 1.5));
    for (const double at : {y, -y}) {  // the wall itself, and its image
      const auto scene = TestScene::from_text(document(
          fmt::format(R"("eye": [0.5, 0.5, 0.7], "look_at": [1, {}, 0])", at), 1e-3, 8,
          diffuse("wall", 1) + also(diffuse("lamp", 0, 1 / (radius * radius))) +
              also(named("mirror", R"("mirror": {})")),
          plane_shape("wall", "[1, 0, 0]", "[-1, 0, 0]") + also(plane_shape("mirror", "[0, 0, 0]", "[0, 1, 0]")) +
              also(sphere("lamp", "[0, 1, 0]", radius))));
      SCOPED_TRACE(at);
      expect_answer(mean_of(clean_picture(scene, "path", 12), 0), irradiance / M_PI, 1e-2);
    }
  }
}

TEST(Materials, GlassInOnAndAcrossGlassIsInvisibleInUniformLight) {
  // Radiance is n² denser in each piece, and 1 again outside.
  const auto seen = [&](const std::string& objects, double reach) {
    return mean_of(clean_picture(TestScene::from_text(document(R"("eye": [0.5, 2, 4], "look_at": [0, 0, 0])", 30, 32,
                                                               kGlassPairMaterials, objects, sky(1)),
                                                      glass_pair_files(reach)),
                                 "path", 8),
                   0);
  };
  for (const GlassPair& pair : glass_pairs()) {
    SCOPED_TRACE(pair.name);
    expect_answer(seen(pair.objects, 1e-3), 1, 2e-3);
  }
  // Where two faces coincide, rounding decides which one a ray meets first, and it may miss the other. No right picture
  // is promised (docs/reference/scene.md), but values are bounded.
  for (const char* const material : {"a", "b"}) {
    const double value = seen(mesh("a", "left.obj") + also(mesh(material, "flush.obj")), 0).value;
    EXPECT_GT(value, 0.9) << material;
    EXPECT_LT(value, 1.1) << material;
  }
}

TEST(Materials, InfiniteAbsorptionLeavesOnlyTheReflection) {
  for (const std::string interior :
       {R"("color": {"rgb": [0, 0, 0]})", R"("absorption": {"rgb": [1e30, 1e30, 1e30]})"}) {
    const Estimate seen = mean_of(scene_of(ink(interior)).render({"path", 55, 0}, 10), 0);
    EXPECT_NEAR(seen.value, 0.04, 5 * seen.standard_error);
    EXPECT_LT(seen.standard_error, 2e-3);
  }
}

TEST(Materials, ACameraOnTheSurfaceOfGlassSeesOneSideOrTheOther) {
  const auto scene = TestScene::from_text(document(
      R"("eye": [0, 0, 1], "look_at": [0, 0, -1])", 20, 16,
      diffuse("sky", 0, 1) + R"(, {"name": "glass", "dielectric": {}, "interior": {"absorption": {"rgb": [0, 0, 0]}}})",
      sphere("sky", "[0, 0, 0]", 20, true) + "," + sphere("glass", "[0, 0, 0]", 1)));
  const Estimate seen = mean_of(scene.render({"path", 56, 0}, 8), 0);
  // Some rays start outside, where radiance is 1, and some inside, where it is n².
  EXPECT_GT(seen.value, 0.98);
  EXPECT_LT(seen.value, 2.3);
}

TEST(Materials, SamplesInTooManyNestedShapesAreCountedAsNotFinite) {
  std::string materials = diffuse("sky", 0, 1), objects = sphere("sky", "[0, 0, 0]", 20, true);
  for (int i = 0; i < 12; ++i) {
    const std::string name = fmt::format("shell{}", i);
    materials +=
        fmt::format(R"(, {{"name": "{}", "dielectric": {{"ior": {}}}, "priority": {}}})", name, 1.1 + 0.05 * i, i % 3);
    objects += fmt::format(",{}", sphere(name, "[0, 0, 0]", 2 - 0.1 * i));
  }
  const auto scene =
      TestScene::from_text(document(R"("eye": [0, 0, 5], "look_at": [0, 0, 0])", 40, 8, materials, objects));
  const HalfImages image = scene.render({"path", 57, 0}, 4);
  const Estimate seen = mean_of(image, 0);
  EXPECT_TRUE(std::isfinite(seen.value));
  EXPECT_LE(seen.value, 1);  // what is seen past the shells; the rest counts as zero
  EXPECT_GT(image.non_finite, 0u);
}

}  // namespace
}  // namespace lightmill::test

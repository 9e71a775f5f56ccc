#include "common/planner/method_plan.h"

#include <gtest/gtest.h>

#include "common/methods/spec/method_spec.h"
#include "common/scene/mesh.h"
#include "tests/unit/planner/planner_scenes.h"

namespace lightmill {
namespace {

TEST(Admit, PathMissesOnlyPointAndSunLightThroughSmoothSurfaces) {
  EXPECT_TRUE(path_finds_all({kWhite}, {kBulb}));
  EXPECT_TRUE(path_finds_all({kWhite, kGlass, emitter()}, {}));
  EXPECT_TRUE(path_finds_all({kWhite, kGlass, kMirror}, {kSky}));
  for (const Light& light : {kBulb, kSun}) {
    for (const Material& smooth : {kMirror, kGlass, metal(0), rough_glass(0.005)}) {
      EXPECT_FALSE(path_finds_all({kWhite, smooth}, {light})) << smooth.name;
    }
    EXPECT_TRUE(path_finds_all({kWhite, metal(0.1)}, {light})) << "emitters are sampled from rough surfaces";
    EXPECT_TRUE(path_finds_all({kWhite, rough_glass(0.1)}, {light}));
  }
}

TEST(Admit, PathMissesPointLightThroughNarrowLobesNotWideOnes) {
  // Measured in tests/atlas: light of a point over such surfaces.
  EXPECT_FALSE(path_finds_all({kWhite, metal(0.0101)}, {kBulb}));
  EXPECT_FALSE(path_finds_all({kWhite, metal(0.05)}, {kBulb}));
  EXPECT_TRUE(path_finds_all({kWhite, metal(0.06)}, {kBulb}));
  Material mapped = metal(0.3);
  mapped.roughness_map.texture = 0;
  Scene scene = scene_of({kWhite, metal(0.3)}, {kBulb});
  EXPECT_TRUE(admit(read_facts(scene), "path").admitted);
  scene.materials[1] = mapped;
  EXPECT_FALSE(admit(read_facts(scene), "path").admitted) << "the map may make it smooth";
  EXPECT_TRUE(admit(read_facts(scene), "caustic").admitted);

  PrincipledMaterial coated;
  coated.metallic = 1;
  coated.roughness = 0.25;
  coated.coat = 1;
  coated.coat_roughness = 0;
  const SceneFacts lacquered = read_facts(scene_of({kWhite, material("lacquered metal", coated)}, {kBulb}));
  EXPECT_FALSE(admit(lacquered, "path").admitted);
  EXPECT_TRUE(admit(lacquered, "caustic").admitted) << "light from casters is followed";

  const SceneFacts gloss = read_facts(scene_of({kWhite, phong(0, 1e6)}, {kBulb}));
  EXPECT_TRUE(gloss.smooth_casters.empty()) << "caustic takes it for a receiver";
  EXPECT_FALSE(admit(gloss, "path").admitted);
  EXPECT_FALSE(admit(gloss, "caustic").admitted);
}

TEST(Admit, PathRarelyMeetsSmallEmitters) {
  // Spheres stand 3 apart. The emitter's centre is 2 from the mirror's surface, so it fills (r/2)²/4 of all directions.
  const double edge = 4 * std::sqrt(kSmallShare);
  const auto lit_by = [&](double radius, const Material& other) {
    Scene scene = scene_of({kWhite, emitter(), other}, {});
    std::get<SphereShape>(scene.objects[1].shape).radius = radius;
    return scene;
  };
  for (const Material& narrow : {kMirror, metal(0.05)}) {
    EXPECT_TRUE(admit(read_facts(lit_by(1.01 * edge, narrow)), "path").admitted);
    const Verdict small = admit(read_facts(lit_by(0.99 * edge, narrow)), "path");
    EXPECT_FALSE(small.admitted);
    EXPECT_NE(small.reason.find("the emitter 'lamp ball'"), std::string::npos) << small.reason;
    EXPECT_NE(small.reason.find("so small a light"), std::string::npos) << small.reason;
  }
  EXPECT_TRUE(admit(read_facts(lit_by(1e-6, metal(0.1))), "path").admitted) << "it is sampled from there";
  EXPECT_TRUE(admit(read_facts(lit_by(1e-6, kMirror)), "caustic").admitted);

  // A moved, rotated and scaled object is the same emitter. Only its final place counts.
  Scene moved = lit_by(0.5 * edge, kMirror);
  moved.objects[1].transform = {{{3, 0, 0, -6}, {0, 0, -3, 0}, {0, 3, 0, 0}}};
  EXPECT_TRUE(admit(read_facts(moved), "path").admitted);
  moved.objects[2].transform = {{{1, 0, 0, 100}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  EXPECT_FALSE(admit(read_facts(moved), "path").admitted);

  // A plane, a triangle, and a mesh if its asset is available.
  Scene over_plane = lit_by(0.5 * edge, kMirror);
  over_plane.objects[2].shape = PlaneShape{{0, -2, 0}, {0, 5, 0}};
  EXPECT_FALSE(admit(read_facts(over_plane), "path").admitted);
  over_plane.objects[2].shape = PlaneShape{{0, -0.5, 0}, {0, 5, 0}};
  EXPECT_TRUE(admit(read_facts(over_plane), "path").admitted);
  Scene triangle = lit_by(1, kMirror);
  triangle.objects[1].shape = TriangleShape{{3, 0, 0}, {3 + edge, 0, 0}, {3, edge, 0}};
  EXPECT_FALSE(admit(read_facts(triangle), "path").admitted);
  Scene mesh = lit_by(1, kMirror);
  mesh.objects[1].shape = MeshShape{"lamp.obj", sha256(as_byte_view("lamp"))};
  const std::string bytes = encode_mesh({{{3, 0, 0}, {3 + edge, 0, 0}, {3, edge, 0}}, {}, {}, {}, {{0, 1, 2}}});
  const MeshSource meshes{[&](const Sha256& digest) {
    return digest == sha256(as_byte_view("lamp")) ? std::optional(bytes) : std::nullopt;
  }};
  EXPECT_FALSE(admit(read_facts(mesh, meshes), "path").admitted);
  EXPECT_TRUE(admit(read_facts(mesh), "path").admitted) << "it is not known how small it is";
  EXPECT_TRUE(
      admit(read_facts(mesh, {[](const Sha256&) { return std::optional<std::string>("no mesh"); }}), "path").admitted);
  mesh.objects[1].transform = {{{4, 0, 0, -9}, {0, 4, 0, 0}, {0, 0, 4, 0}}};
  EXPECT_TRUE(admit(read_facts(mesh, meshes), "path").admitted) << "four times as large";
  triangle.objects[1].shape = TriangleShape{{3, 0, 0}, {3 + 4 * edge, 0, 0}, {3, 4 * edge, 0}};
  EXPECT_TRUE(admit(read_facts(triangle), "path").admitted);
}

TEST(Admit, ASpotMattersOnlyWhereItShines) {
  // The ball lies 3 beside the spot's foot and 5 below the spot, with a radius of 1: from 20.9° to 41° off the
  // vertical.
  const auto path_finds_all = [](const Point3d& direction, double cutoff_degrees) {
    const Light spot{"spot", SpotLight{{0, 5, 0}, direction, {1, 1, 1}, cutoff_degrees}};
    return admit(read_facts(scene_of({kWhite, kGlass}, {spot})), "path").admitted;
  };
  EXPECT_TRUE(path_finds_all({0, 1, 0}, 20));
  EXPECT_TRUE(path_finds_all({0, -1, 0}, 20.5));
  EXPECT_FALSE(path_finds_all({0, -1, 0}, 21.5));
  EXPECT_FALSE(path_finds_all({0, 1, 0}, 180));
  EXPECT_FALSE(path_finds_all({3, -5, 0}, 1));
}

TEST(Admit, ASunOfAnAngleIsSmallUnlessItFillsEnoughOfTheSky) {
  // It fills (1 − cos(angle/2))/2 of all directions: 5.3e-6 at 0.53°, and 1e-5 at 0.7247°.
  const auto with_angle = [](double degrees) {
    return read_facts(scene_of({kWhite, kGlass}, {{"sun", DirectionalLight{{0, -1, 0}, {1, 1, 1}, degrees}}}));
  };
  EXPECT_FALSE(admit(with_angle(0.53), "path").admitted);
  EXPECT_FALSE(admit(with_angle(0.72), "path").admitted);
  EXPECT_TRUE(admit(with_angle(0.73), "path").admitted);
  EXPECT_TRUE(with_angle(0.53).delta_lights.empty());
  EXPECT_TRUE(admit(with_angle(0.53), "caustic").admitted);
  const std::vector<std::string> features = features_of(with_angle(5));
  EXPECT_EQ(std::ranges::count(features, "lights with a size"), 1);
  EXPECT_EQ(std::ranges::count(features, "light sampling"), 1);
}

TEST(Admit, APointLightWithARadiusIsSmallUnlessItIsNear) {
  // The ball of radius 1 is at (3, 0, 0). From its surface, a light of radius r at height 5 fills r²/4d² of all
  // directions, with d² = (√34 − 1)².
  const double d = std::sqrt(34) - 1, limit = 2 * d * std::sqrt(kSmallShare);
  const auto path_with = [](double radius) {
    return admit(read_facts(scene_of({kWhite, kGlass}, {{"bulb", PointLight{{0, 5, 0}, {1, 1, 1}, radius}}})), "path")
        .admitted;
  };
  EXPECT_FALSE(path_with(0));
  EXPECT_FALSE(path_with(0.98 * limit));
  EXPECT_TRUE(path_with(1.02 * limit));
}

TEST(Admit, CausticDoesNotCoverInfinitePlanesUnderDistantLight) {
  Light window = kSky;
  std::get<EnvironmentLight>(window.kind).has_image = true;
  const auto over_plane = [](const Material& material, const Light& light) {
    Scene scene = scene_of({kGray, material}, {light});
    scene.objects[1].shape = PlaneShape{{0, -2, 0}, {0, 1, 0}};
    return read_facts(scene);
  };
  for (const Light& light : {kSun, window}) {
    const Verdict caustic = admit(over_plane(kMirror, light), "caustic");
    EXPECT_FALSE(caustic.admitted) << light.name;
    EXPECT_NE(caustic.reason.find("'" + light.name + "'"), std::string::npos) << caustic.reason;
    EXPECT_TRUE(admit(over_plane(kWhite, light), "caustic").admitted) << "it casts nothing";
    EXPECT_TRUE(admit(read_facts(scene_of({kWhite, kMirror}, {light})), "caustic").admitted) << "it has an end";
  }
  for (const Light& light : {kBulb, kSky}) {
    EXPECT_TRUE(admit(over_plane(kMirror, light), "caustic").admitted) << light.name;
  }
}

TEST(Admit, VcmDoesNotCoverInfiniteSmoothCoatsUnderDistantLight) {
  const auto over_plane = [](const Material& material, const Light& light) {
    Scene scene = scene_of({kGray, material}, {light});
    scene.objects[1].shape = PlaneShape{{0, -2, 0}, {0, 1, 0}};
    return read_facts(scene);
  };
  for (const Material& layer : {lacquer(0), phong(0.4f, 1e6), kMirror}) {
    const Verdict vcm = admit(over_plane(layer, kSun), "vcm");
    EXPECT_FALSE(vcm.admitted) << layer.name;
    EXPECT_NE(vcm.reason.find("'sun'"), std::string::npos) << vcm.reason;
    EXPECT_NE(vcm.reason.find("'" + layer.name + " ball'"), std::string::npos) << vcm.reason;
    EXPECT_TRUE(admit(read_facts(scene_of({kGray, layer}, {kSun})), "vcm").admitted) << "it has an end";
    EXPECT_TRUE(admit(over_plane(layer, kBulb), "vcm").admitted) << layer.name;
  }
  EXPECT_EQ(admit(over_plane(lacquer(0), kSun), "path").finder, "no method");
  EXPECT_TRUE(admit(over_plane(kWhite, kSun), "vcm").admitted) << "its light samples the sun";
}

/// Photons never start at spheres with textured emission, and no method draws points on them.
TEST(Admit, NoMethodFindsSmallUnsampledEmitters) {
  const double edge = 4 * std::sqrt(kSmallShare);  // 2 away from the other ball: as above
  const auto lit_by = [&](double radius, const Material& other) {
    Material emitter_of_texture = emitter();
    emitter_of_texture.emission.texture = 0;
    Scene scene = scene_of({emitter_of_texture, other}, {});
    std::get<SphereShape>(scene.objects[0].shape).radius = radius;
    return scene;
  };
  for (const Material& other : {kMirror, metal(0.05), kGray, lacquer(0)}) {
    Scene scene = lit_by(0.99 * edge, other);
    scene.meters.push_back({"far", IrradianceMeter{{0, 0, 100}, {0, 0, -1}}});
    for (const char* const method : {"path", "caustic", "vcm", "ppm"}) {
      const Verdict small = admit(read_facts(scene), method);
      EXPECT_FALSE(small.admitted) << method << ", " << other.name;
      EXPECT_NE(small.reason.find("'lamp ball'"), std::string::npos) << small.reason;
    }
    const std::vector<std::string> instead = plan_method(read_facts(scene), "auto").candidates;
    EXPECT_EQ(instead, std::vector<std::string>{"path"}) << other.name;
    scene.meters.clear();
    std::get<SphereShape>(scene.objects[0].shape).radius = 1.01 * edge;
    for (const char* const method : {"path", "caustic", "vcm"}) {
      EXPECT_TRUE(admit(read_facts(scene), method).admitted) << method << ", " << other.name;
    }
  }
  EXPECT_TRUE(admit(read_facts(lit_by(1e-6, kBlack)), "path").admitted) << "it shines on nothing";
  Scene metered = lit_by(edge / 4, kBlack);
  metered.meters.push_back({"at half of it", IrradianceMeter{{0, 0, 0.45}, {0, 0, -1}}});
  EXPECT_TRUE(admit(read_facts(metered), "path").admitted) << "large as seen from there";
  metered.meters[0].kind = FluxMeter{{{0, -1, 2}, {0, 2, 0}, {1, 0, 0}}};
  EXPECT_FALSE(admit(read_facts(metered), "path").admitted);
  Object plane{"plane", 2, PlaneShape{}};
  plane.transform[2][3] = 1;
  metered.materials.push_back(kGray);
  metered.objects.push_back(plane);
  EXPECT_TRUE(admit(read_facts(metered), "path").admitted) << "the distance of a moved plane is unknown";
}

TEST(Admit, NoLightIsMissedWithoutAReceiver) {
  EXPECT_TRUE(path_finds_all({kMirror, kGlass}, {kBulb}));
  EXPECT_TRUE(path_finds_all({kBlack, kGlass}, {kBulb}));
  EXPECT_TRUE(path_finds_all({material("ground", ShadowCatcherMaterial{}), kGlass}, {kBulb}))
      << "shadow catchers receive no caustics";
  EXPECT_FALSE(path_finds_all({rough_glass(0.3), kMirror}, {kBulb})) << "rough glass is lit by the mirror";

  Scene metered = scene_of({kBlack, kGlass}, {kBulb});
  metered.meters.push_back({"floor", IrradianceMeter{}});
  EXPECT_FALSE(admit(read_facts(metered), "path").admitted);
  metered.meters = {{"eye", RadianceMeter{}}};
  EXPECT_TRUE(admit(read_facts(metered), "path").admitted) << "it sees the same light as a camera";

  Material milk = kGlass;
  milk.interior.scattering = {1, 1, 1};
  EXPECT_FALSE(path_finds_all({milk}, {kBulb}));
  EXPECT_TRUE(admit(read_facts(scene_of({milk}, {kBulb})), "caustic").admitted) << "photons scatter in milk";
}

TEST(Admit, UnusedMaterialsAndLightsDoNotCount) {
  Scene scene = scene_of({kWhite, kGlass}, {kBulb});
  scene.objects.pop_back();
  EXPECT_TRUE(admit(read_facts(scene), "path").admitted) << "no object is of glass";
  EXPECT_TRUE(path_finds_all({kWhite, kGlass}, {{"off", PointLight{}}}));
  const Material air = material("air", DielectricMaterial{1});
  EXPECT_TRUE(path_finds_all({kWhite, air}, {kBulb})) << "it does not change light";
  EXPECT_FALSE(path_finds_all({kWhite, air, rough_glass(0.3)}, {kBulb})) << "it may be a bubble in glass";
}

TEST(Admit, ASmoothLayerOverADiffuseBaseHidesLightFromPathAndCaustic) {
  const SceneFacts facts = read_facts(scene_of({kWhite, lacquer(0)}, {kBulb}));
  EXPECT_TRUE(facts.casters.empty());
  const Verdict path = admit(facts, "path");
  EXPECT_FALSE(path.admitted);
  EXPECT_NE(path.reason.find("'lacquer ball'"), std::string::npos) << path.reason;
  EXPECT_FALSE(admit(facts, "caustic").admitted);
  EXPECT_TRUE(path_finds_all({kWhite, lacquer(0)}, {kSky}));
}

TEST(Admit, ReasonsNameTheLightAndTheGlass) {
  const Verdict path = admit(read_facts(scene_of({kWhite, kGlass, kMirror}, {kBulb, kSun})), "path");
  EXPECT_EQ(path.reason,
            "camera paths never hit the point light 'bulb' (and 1 more light), so its light by way of the glass 'glass "
            "ball' (and 1 more object) is missing");
  EXPECT_EQ(path.finder, "caustic");
}

TEST(Admit, EveryMethodHasAVerdict) {
  const std::vector<Verdict> all = admit_all(read_facts(scene_of({kWhite, emitter()}, {})));
  EXPECT_EQ(all.size(), method_names().size() - 1) << "all but auto";
  for (const Verdict& verdict : all) {
    EXPECT_TRUE(verdict.admitted || !verdict.reason.empty()) << verdict.method;
    if (verdict.method == "raycast" || verdict.method == "whitted") {
      EXPECT_NE(verdict.reason.find("emitters as points"), std::string::npos) << verdict.reason;
    }
  }
}

TEST(Admit, PpmFindsAllLightThatEmitsPhotons) {
  const auto admitted = [](const std::vector<Material>& materials, const std::vector<Light>& lights) {
    return admit(read_facts(scene_of(materials, lights)), "ppm").admitted;
  };
  EXPECT_TRUE(admitted({kWhite, kGlass, kMirror, emitter()}, {kBulb, kSun}));
  EXPECT_TRUE(admitted({kWhite, lacquer(0)}, {kBulb})) << "it gathers beside single directions";
  EXPECT_EQ(admit(read_facts(scene_of({kWhite, lacquer(0)}, {kBulb})), "path").finder, "vcm");
  Material milk = kGlass;
  milk.interior.scattering = {1, 1, 1};
  EXPECT_TRUE(admitted({milk}, {kBulb}));
  Scene scene = scene_of({kWhite, emitter()}, {kBulb});
  scene.objects[0].shape = PlaneShape{};
  EXPECT_TRUE(admit(read_facts(scene), "ppm").admitted);
  scene.lights.push_back(kSun);
  EXPECT_FALSE(admit(read_facts(scene), "ppm").admitted) << "the sun shines on all of the plane";
  scene.lights.pop_back();
  std::swap(scene.objects[0].shape, scene.objects[1].shape);
  EXPECT_NE(admit(read_facts(scene), "ppm").reason.find("emits no photons"), std::string::npos);
}

TEST(Admit, PpmNeedsASceneThatFillsMuchOfThePicture) {
  Scene scene = scene_of({kWhite}, {kBulb});  // a ball of radius 1 at the origin
  const auto verdict = [&](double distance, double degrees) {
    scene.camera.eye = {0, 0, distance};
    scene.camera.vertical_fov_degrees = degrees;
    return admit(read_facts(scene), "ppm");
  };
  EXPECT_TRUE(verdict(4, 40).admitted);
  EXPECT_TRUE(verdict(4'000, 0.04).admitted) << "the same picture, from afar";
  EXPECT_FALSE(verdict(4, 0.04).admitted) << "a thousandth of it";
  // 512 pixels: (tan(0.02°)/256 · 4/√3)² / 4 · 9, by the ball's box. At least 1e-8 is required.
  EXPECT_NE(verdict(4, 0.04).reason.find("one of 4e+10 photons"), std::string::npos) << verdict(4, 0.04).reason;
}

TEST(Admit, VcmMissesOnlyLightScatteredInMedia) {
  const SceneFacts coated = read_facts(scene_of({kWhite, lacquer(0)}, {kBulb}));
  EXPECT_TRUE(admit(coated, "vcm").admitted);
  EXPECT_EQ(plan_method(coated, "auto").candidates, std::vector<std::string>{"vcm"});
  const SceneFacts glass = read_facts(scene_of({kWhite, kGlass}, {kBulb}));
  EXPECT_EQ(plan_method(glass, "auto").candidates, std::vector<std::string>{"caustic"}) << "with less work";
  Material milk = kGlass;
  milk.interior.scattering = {1, 1, 1};
  EXPECT_FALSE(admit(read_facts(scene_of({milk}, {kBulb})), "vcm").admitted);
}

}  // namespace
}  // namespace lightmill

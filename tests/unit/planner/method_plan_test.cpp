#include "common/planner/method_plan.h"

#include <gtest/gtest.h>

#include "common/methods/spec/method_spec.h"
#include "common/scene/casters.h"
#include "common/scene/mesh.h"

namespace lightmill {
namespace {

Material material(const std::string& name, auto kind) {
  Material made;
  made.name = name;
  made.kind = kind;
  return made;
}

/// Spheres side by side, one of each material, and these lights.
Scene scene_of(std::vector<Material> materials, std::vector<Light> lights) {
  Scene scene;
  for (std::uint32_t i = 0; i < materials.size(); ++i) {
    scene.objects.push_back({materials[i].name + " ball", i, SphereShape{{3.0 * i, 0, 0}, 1}});
  }
  scene.materials = std::move(materials);
  scene.lights = std::move(lights);
  EXPECT_TRUE(validate(scene).ok()) << validate(scene);
  return scene;
}

const Light kBulb{"bulb", PointLight{{0, 5, 0}, {1, 1, 1}}};
const Light kSun{"sun", DirectionalLight{{0, -1, 0}, {1, 1, 1}}};
const Light kSky{"sky", EnvironmentLight{}};
const Material kWhite = material("white", DiffuseMaterial{});
const Material kGray = material("gray", DiffuseMaterial{{0.5f, 0.5f, 0.5f}});
const Material kBlack = material("black", DiffuseMaterial{{0, 0, 0}});
const Material kMirror = material("mirror", MirrorMaterial{});
const Material kGlass = material("glass", DielectricMaterial{});

Material lamp() {
  Material made = material("lamp", DiffuseMaterial{});
  made.emission = {1, 1, 1};
  return made;
}
Material rough_glass(double roughness) {
  return material("frosted", DielectricMaterial{1.5, roughness});
}
Material metal(double roughness) {
  return material("metal", ConductorMaterial{{0.2f, 0.9f, 1.1f}, {3.9f, 2.4f, 2.2f}, roughness});
}
Material lacquer(double roughness) {
  PrincipledMaterial made;
  made.roughness = roughness;
  return material("lacquer", made);
}

Material phong(float diffuse, double exponent) {
  return material("gloss", PhongMaterial{{diffuse, diffuse, diffuse}, {0.4f, 0.4f, 0.4f}, exponent});
}

bool path_finds_all(std::vector<Material> materials, std::vector<Light> lights) {
  return admit(read_facts(scene_of(std::move(materials), std::move(lights))), "path").admitted;
}

TEST(Casters, AreMirrorsGlassAndMetalAsLongAsTheyAreNarrow) {
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
  EXPECT_FALSE(is_caster(material("holdout", HoldoutMaterial{})));
  EXPECT_EQ(narrow_lobes(material("black mirror", MirrorMaterial{{0, 0, 0}})), NarrowLobes::none);
}

TEST(Casters, APrincipledMaterialIsOneIfNothingOfItIsWide) {
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
  EXPECT_FALSE(receives_light(material("holdout", HoldoutMaterial{})));
}

TEST(Admit, PathFindsAllButWhatLampsWithoutExtentSendThroughSmoothSurfaces) {
  EXPECT_TRUE(path_finds_all({kWhite}, {kBulb}));
  EXPECT_TRUE(path_finds_all({kWhite, kGlass, lamp()}, {}));
  EXPECT_TRUE(path_finds_all({kWhite, kGlass, kMirror}, {kSky}));
  for (const Light& light : {kBulb, kSun}) {
    for (const Material& smooth : {kMirror, kGlass, metal(0), rough_glass(0.005)}) {
      EXPECT_FALSE(path_finds_all({kWhite, smooth}, {light})) << smooth.name;
    }
    EXPECT_TRUE(path_finds_all({kWhite, metal(0.1)}, {light})) << "lamps are sampled from rough surfaces";
    EXPECT_TRUE(path_finds_all({kWhite, rough_glass(0.1)}, {light}));
  }
}

TEST(Admit, PathDoesNotFindThroughNarrowLobesWhatItFindsThroughWideOnes) {
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
  EXPECT_TRUE(admit(lacquered, "caustic").admitted) << "all that a caster sends on is followed";

  const SceneFacts gloss = read_facts(scene_of({kWhite, phong(0, 1e6)}, {kBulb}));
  EXPECT_TRUE(gloss.smooth_casters.empty()) << "caustic takes it for a receiver";
  EXPECT_FALSE(admit(gloss, "path").admitted);
  EXPECT_FALSE(admit(gloss, "caustic").admitted);
}

TEST(Admit, PathHardlyMeetsSmallLamps) {
  // Spheres stand 3 apart: from the mirror's surface the lamp's centre is 2 away, and fills (r/2)²/4 of all directions.
  const double edge = 4 * std::sqrt(kSmallShare);
  const auto lit_by = [&](double radius, const Material& other) {
    Scene scene = scene_of({kWhite, lamp(), other}, {});
    std::get<SphereShape>(scene.objects[1].shape).radius = radius;
    return scene;
  };
  for (const Material& narrow : {kMirror, metal(0.05)}) {
    EXPECT_TRUE(admit(read_facts(lit_by(1.01 * edge, narrow)), "path").admitted);
    const Verdict small = admit(read_facts(lit_by(0.99 * edge, narrow)), "path");
    EXPECT_FALSE(small.admitted);
    EXPECT_NE(small.reason.find("the lamp 'lamp ball'"), std::string::npos) << small.reason;
    EXPECT_NE(small.reason.find("so small a lamp"), std::string::npos) << small.reason;
  }
  EXPECT_TRUE(admit(read_facts(lit_by(1e-6, metal(0.1))), "path").admitted) << "it is sampled from there";
  EXPECT_TRUE(admit(read_facts(lit_by(1e-6, kMirror)), "caustic").admitted);

  // Moved, turned and enlarged it is the same lamp: what counts is where it ends up.
  Scene moved = lit_by(0.5 * edge, kMirror);
  moved.objects[1].transform = {{{3, 0, 0, -6}, {0, 0, -3, 0}, {0, 3, 0, 0}}};
  EXPECT_TRUE(admit(read_facts(moved), "path").admitted);
  moved.objects[2].transform = {{{1, 0, 0, 100}, {0, 1, 0, 0}, {0, 0, 1, 0}}};
  EXPECT_FALSE(admit(read_facts(moved), "path").admitted);

  // A plane, a triangle, and a mesh, if it is at hand.
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
  const std::string bytes = encode_mesh({{{3, 0, 0}, {3 + edge, 0, 0}, {3, edge, 0}}, {}, {}, {{0, 1, 2}}});
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

TEST(Admit, ASpotHidesOnlyWhatItMayShineOn) {
  // The ball lies 3 off the spot's foot, 5 below it, with a radius of 1: from 20.9° to 41° off the straight way down.
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

TEST(Admit, CausticDoesNotCoverPlanesWithoutEndFromAfar) {
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

TEST(Admit, VcmDoesNotCoverSmoothCoatsWithoutEndFromAfar) {
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
  const std::string path = admit(over_plane(lacquer(0), kSun), "path").reason;
  EXPECT_NE(path.find("no method that there is finds it"), std::string::npos) << path;
  EXPECT_TRUE(admit(over_plane(kWhite, kSun), "vcm").admitted) << "it is lit by what samples the sun";
}

/// Photons never start at spheres that glow by a texture, and nothing draws points of them.
TEST(Admit, NoMethodFindsSmallLampsThatAreNeverSampled) {
  const double edge = 4 * std::sqrt(kSmallShare);  // 2 away from the other ball: as above
  const auto lit_by = [&](double radius, const Material& other) {
    Material lamp_of_texture = lamp();
    lamp_of_texture.emission.texture = 0;
    Scene scene = scene_of({lamp_of_texture, other}, {});
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
}

TEST(Admit, WithoutAReceiverNothingIsMissing) {
  EXPECT_TRUE(path_finds_all({kMirror, kGlass}, {kBulb}));
  EXPECT_TRUE(path_finds_all({kBlack, kGlass}, {kBulb}));
  EXPECT_TRUE(path_finds_all({material("ground", HoldoutMaterial{}), kGlass}, {kBulb}))
      << "holdouts receive no caustics";
  EXPECT_FALSE(path_finds_all({rough_glass(0.3), kMirror}, {kBulb})) << "rough glass is lit by the mirror";

  Scene metered = scene_of({kBlack, kGlass}, {kBulb});
  metered.meters.push_back({"floor", IrradianceMeter{}});
  EXPECT_FALSE(admit(read_facts(metered), "path").admitted);
  metered.meters = {{"eye", RadianceMeter{}}};
  EXPECT_TRUE(admit(read_facts(metered), "path").admitted) << "it sees what a camera sees";

  Material milk = kGlass;
  milk.interior.scattering = {1, 1, 1};
  EXPECT_FALSE(path_finds_all({milk}, {kBulb}));
}

TEST(Admit, OnlyWhatIsThereCounts) {
  Scene scene = scene_of({kWhite, kGlass}, {kBulb});
  scene.objects.pop_back();
  EXPECT_TRUE(admit(read_facts(scene), "path").admitted) << "no object is of glass";
  EXPECT_TRUE(path_finds_all({kWhite, kGlass}, {{"off", PointLight{}}}));
  const Material air = material("air", DielectricMaterial{1});
  EXPECT_TRUE(path_finds_all({kWhite, air}, {kBulb})) << "light does not notice it";
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

TEST(Admit, ReasonsNameTheLampAndTheGlass) {
  const std::string reason = admit(read_facts(scene_of({kWhite, kGlass, kMirror}, {kBulb, kSun})), "path").reason;
  for (const char* part : {"the point light 'bulb'", "(and 1 more light)", "(and 1 more object)",
                           "the glass 'glass ball'", "never meet"}) {
    EXPECT_NE(reason.find(part), std::string::npos) << reason;
  }
}

TEST(Admit, EveryMethodHasAVerdict) {
  const std::vector<Verdict> all = admit_all(read_facts(scene_of({kWhite, lamp()}, {})));
  EXPECT_EQ(all.size(), method_names().size() - 1) << "all but auto";
  for (const Verdict& verdict : all) {
    EXPECT_TRUE(verdict.admitted || !verdict.reason.empty()) << verdict.method;
    if (verdict.method == "raycast" || verdict.method == "whitted") {
      EXPECT_NE(verdict.reason.find("lamps for points"), std::string::npos) << verdict.reason;
    }
  }
}

TEST(Admit, PpmFindsAllThatPhotonsCanStartFrom) {
  const auto admitted = [](const std::vector<Material>& materials, const std::vector<Light>& lights) {
    return admit(read_facts(scene_of(materials, lights)), "ppm").admitted;
  };
  EXPECT_TRUE(admitted({kWhite, kGlass, kMirror, lamp()}, {kBulb, kSun}));
  EXPECT_TRUE(admitted({kWhite, lacquer(0)}, {kBulb})) << "it gathers beside single directions";
  EXPECT_NE(admit(read_facts(scene_of({kWhite, lacquer(0)}, {kBulb})), "path").reason.find("vcm finds it"),
            std::string::npos);
  Material milk = kGlass;
  milk.interior.scattering = {1, 1, 1};
  EXPECT_FALSE(admitted({milk}, {kBulb}));
  Scene scene = scene_of({kWhite, lamp()}, {kBulb});
  scene.objects[0].shape = PlaneShape{};
  EXPECT_TRUE(admit(read_facts(scene), "ppm").admitted);
  scene.lights.push_back(kSun);
  EXPECT_FALSE(admit(read_facts(scene), "ppm").admitted) << "the sun shines on all of the plane";
  scene.lights.pop_back();
  std::swap(scene.objects[0].shape, scene.objects[1].shape);
  EXPECT_NE(admit(read_facts(scene), "ppm").reason.find("no photons start at"), std::string::npos);
}

TEST(Admit, VcmFindsAllButWhatMediaScatter) {
  const SceneFacts coated = read_facts(scene_of({kWhite, lacquer(0)}, {kBulb}));
  EXPECT_TRUE(admit(coated, "vcm").admitted);
  EXPECT_EQ(plan_method(coated, "auto").candidates, std::vector<std::string>{"vcm"});
  const SceneFacts glass = read_facts(scene_of({kWhite, kGlass}, {kBulb}));
  EXPECT_EQ(plan_method(glass, "auto").candidates, std::vector<std::string>{"caustic"}) << "with less work";
  Material milk = kGlass;
  milk.interior.scattering = {1, 1, 1};
  EXPECT_FALSE(admit(read_facts(scene_of({milk}, {kBulb})), "vcm").admitted);
}

TEST(Plan, AMethodAskedForByNameStays) {
  const SceneFacts facts = read_facts(scene_of({kWhite, kGlass}, {kBulb}));
  for (const char* method : {"path", "whitted:flat,glass=0.1", "ao:distance=2"}) {
    const MethodPlan plan = plan_method(facts, method);
    EXPECT_EQ(plan.candidates, std::vector<std::string>{method});
    EXPECT_TRUE(plan.reasons.empty());
  }
}

TEST(Plan, AutoTakesPathWhereItFindsAllAndSaysWhy) {
  const MethodPlan plan = plan_method(read_facts(scene_of({kWhite, lamp()}, {})), "auto");
  EXPECT_EQ(plan.candidates, std::vector<std::string>{"path"});
  ASSERT_EQ(plan.reasons.size(), 1u);
  EXPECT_FALSE(plan.reasons[0].empty());
  EXPECT_EQ(plan_method(read_facts(scene_of({kWhite}, {kSky})), "auto:brute-force").candidates,
            std::vector<std::string>{"path:brute-force"});
}

TEST(Plan, AutoPicksAMethodThatThereIsForEveryScene) {
  for (const SceneFacts& facts :
       {read_facts(scene_of({kWhite, kGlass}, {kBulb})), read_facts(scene_of({kWhite, lacquer(0)}, {kBulb})),
        read_facts(scene_of({kMirror}, {kSky})), read_facts(scene_of({kBlack}, {}))}) {
    const MethodPlan plan = plan_method(facts, "auto");
    ASSERT_FALSE(plan.candidates.empty());
    EXPECT_FALSE(plan.reasons.empty());
    for (const std::string& method : plan.candidates) {
      EXPECT_TRUE(parse_method(method).ok()) << method;
      EXPECT_EQ(admit(facts, method).admitted, method_notices(facts, method).empty());
      EXPECT_TRUE(plan.candidates.size() == 1 || admit(facts, method).admitted) << "pilots cannot see what is missing";
    }
  }
}

TEST(Notices, AreOfMethodsThatMissLight) {
  const SceneFacts glass = read_facts(scene_of({kWhite, kGlass}, {kBulb}));
  ASSERT_EQ(method_notices(glass, "path:brute-force").size(), 1u);
  EXPECT_TRUE(method_notices(glass, "path")[0].starts_with("path: "));
  EXPECT_EQ(method_notices(glass, "whitted:flat").size(), 1u);
  EXPECT_EQ(method_notices(glass, "raycast").size(), 1u);
  EXPECT_TRUE(method_notices(glass, "preview").empty()) << "shows no light at all";
  EXPECT_TRUE(method_notices(glass, "ao:distance=1").empty());
  EXPECT_TRUE(method_notices(read_facts(scene_of({kWhite, kGlass}, {kSky})), "path").empty());
}

TEST(Notices, TellWhereReadingsAreBlurred) {
  Scene scene = scene_of({kWhite, kGlass}, {kBulb});
  scene.meters.push_back({"patch", PatchMeter{}});
  EXPECT_TRUE(method_notices(read_facts(scene), "ppm").empty());
  scene.meters.push_back({"desk", IrradianceMeter{}});
  const SceneFacts facts = read_facts(scene);
  for (const char* const method : {"ppm:radius=1", "caustic", "vcm"}) {
    ASSERT_EQ(method_notices(facts, method).size(), 1u) << method;
    EXPECT_NE(method_notices(facts, method)[0].find("the point meter 'desk'"), std::string::npos);
  }
  EXPECT_EQ(method_notices(facts, "path").size(), 1u) << "of the light alone that it misses";
}

TEST(Facts, ManyThingsAreCountedAndSomeNamed) {
  std::vector<Material> many;
  for (int i = 0; i < 40; ++i) {
    many.push_back(material(fmt::format("glass {}", i), DielectricMaterial{}));
  }
  const SceneFacts facts = read_facts(scene_of(many, {kSky}));
  EXPECT_EQ(facts.casters.count, 40u);
  EXPECT_EQ(facts.casters.names.size(), NamedThings::kMostNames);
  EXPECT_NE(facts.casters.text().find("and 32 more"), std::string::npos) << facts.casters.text();
}

TEST(Facts, FeaturesAreThoseOfTheScene) {
  EXPECT_EQ(features_of(read_facts(scene_of({kWhite}, {kBulb}))), std::vector<std::string>{"light sampling"});
  Material amber = kGlass;
  amber.interior.absorption = {0, 1, 2};
  Scene scene = scene_of({amber, lamp()}, {kSky});
  scene.camera.lens_radius = 1;
  EXPECT_EQ(features_of(read_facts(scene)),
            (std::vector<std::string>{"light sampling", "emissive surfaces", "constant environment", "media",
                                      "absorption", "lens"}));
}

TEST(Facts, ASceneThatLosesNoLightIsFlagged) {
  const Material snow = material("snow", DiffuseMaterial{{1, 0.9f, 0.9f}});
  EXPECT_TRUE(read_facts(scene_of({snow, kMirror, kGlass}, {kSky})).lossless) << "red goes on for ever";
  EXPECT_FALSE(read_facts(scene_of({snow, kWhite}, {kSky})).lossless);
  Material amber = kGlass;
  amber.interior.absorption = {1, 0, 0};
  EXPECT_FALSE(read_facts(scene_of({snow, amber}, {kSky})).lossless);
  EXPECT_EQ(read_facts(scene_of({snow, kWhite}, {kSky})).largest_albedo, 1);
}

}  // namespace
}  // namespace lightmill

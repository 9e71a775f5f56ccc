// Promises of every method: a node's bits depend only on scene, seed, pixel and samples.
#include "common/methods/method.h"

#include <gtest/gtest.h>

#include "common/methods/fingerprint.h"
#include "common/methods/spec/method_spec.h"
#include "tests/support/paths.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

/// A method and the layers that it fills.
struct MethodCase {
  std::string name;
  std::vector<std::string> layers;

  friend void PrintTo(const MethodCase& what, std::ostream* out) {
    *out << what.name << " with " << what.layers.size() << " layers";
  }
};

class Methods : public ::testing::TestWithParam<MethodCase> {
 protected:
  Methods() : scene_(test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(100, 90)) {
    auto compiled = CompiledScene::compile(scene_.scene(), scene_.assets());
    EXPECT_TRUE(compiled.ok());
    compiled_ = *compiled;
    auto method = make_method(compiled_, settings(42));
    EXPECT_TRUE(method.ok());
    method_ = std::move(*method);
  }
  static MethodSettings settings(std::uint64_t seed) {
    return {GetParam().name, seed, 0, *film_layers(GetParam().layers)};
  }
  static NodeLayout layout() { return NodeLayout(settings(0).layers); }
  Node render(const PixelRect& rect, SampleRange range) const {
    return method_->render(rect, range, *method_->make_workspace());
  }

  test::TestScene scene_;
  std::shared_ptr<const CompiledScene> compiled_;
  std::unique_ptr<Method> method_;
};

TEST_P(Methods, ANodeHasTheBitsOfItsJoinedChildren) {
  const PixelRect tile{64, 0, 36, 64};
  // The last range crosses the sample index at which splitting and roulette change.
  for (const SampleRange range : {SampleRange{1, 0}, {2, 1}, {3, 3}, {5, 0}, {7, 0}}) {
    const Node left = render(tile, range.left_child()), right = render(tile, range.right_child());
    EXPECT_EQ(render(tile, range).values, join(left, right, layout()).values) << range.level << " " << range.index;
  }
}

TEST_P(Methods, AStoppedRenderHasNoValuesAndLeavesNothingBehind) {
  const PixelRect tile{0, 0, 64, 64};
  const std::unique_ptr<Workspace> workspace = method_->make_workspace();
  std::stop_source stop;
  workspace->stop = stop.get_token();
  stop.request_stop();
  EXPECT_TRUE(method_->render(tile, {2, 0}, *workspace).values.empty());
  workspace->stop = {};
  EXPECT_EQ(method_->render(tile, {2, 0}, *workspace).values, render(tile, {2, 0}).values);
}

TEST_P(Methods, APixelHasTheSameBitsInEveryRectangle) {
  const SampleRange range{3, 1};
  const PixelRect tile{0, 0, 64, 64}, part{5, 31, 13, 7};
  const Node whole = render(tile, range), crop = render(part, range);
  const auto tile_pixels = static_cast<std::size_t>(tile.pixel_count());
  const auto part_pixels = static_cast<std::size_t>(part.pixel_count());
  ASSERT_EQ(whole.values.size(), layout().values(range) * tile_pixels);
  for (std::size_t plane = 0; plane < layout().values(range); ++plane) {
    for (int y = 0; y < part.height; ++y) {
      for (int x = 0; x < part.width; ++x) {
        EXPECT_EQ(crop.values[plane * part_pixels + y * part.width + x],
                  whole.values[plane * tile_pixels + (part.y + y) * tile.width + part.x + x]);
      }
    }
  }
}

TEST_P(Methods, AReusedWorkspaceDoesNotChangeBits) {
  const auto workspace = method_->make_workspace();
  const Node first = method_->render({0, 0, 64, 64}, {2, 0}, *workspace);
  method_->render({64, 64, 36, 26}, {4, 3}, *workspace);
  EXPECT_EQ(method_->render({0, 0, 64, 64}, {2, 0}, *workspace).values, first.values);
}

TEST_P(Methods, TheCallersFloatingPointModeHasNoEffectAndIsRestored) {
  const Node plain = render({0, 0, 64, 64}, {2, 0});
  const unsigned saved = _mm_getcsr();
  const unsigned odd_mode = saved | 0x8040u | 0x6000u;  // flush and take denormals as zero, round towards zero
  _mm_setcsr(odd_mode);
  const Node other = render({0, 0, 64, 64}, {2, 0});
  const unsigned after = _mm_getcsr();
  _mm_setcsr(saved);
  EXPECT_EQ(other.values, plain.values);
  EXPECT_EQ(after & 0xffc0u, odd_mode & 0xffc0u);
}

TEST_P(Methods, AnotherSeedGivesAnotherPicture) {
  auto other = make_method(compiled_, settings(43));
  ASSERT_TRUE(other.ok());
  const PixelRect tile{0, 0, 64, 64};
  EXPECT_NE((*other)->render(tile, {2, 0}, *(*other)->make_workspace()).values, render(tile, {2, 0}).values);
}

TEST_P(Methods, TheSpecStatesWhetherLightsAndBouncesMatter) {
  const std::string name = parse_method(GetParam().name)->name;
  const auto picture = [](std::shared_ptr<const CompiledScene> scene, std::uint32_t max_bounces) {
    const auto method = make_method(std::move(scene), {GetParam().name, 42, max_bounces});
    EXPECT_TRUE(method.ok());
    return (*method)->render({30, 26, 64, 64}, {1, 0}, *(*method)->make_workspace()).values;
  };
  Scene dark = scene_.scene();
  for (Material& material : dark.materials) {
    material.emission = {};
  }
  auto compiled = CompiledScene::compile(dark, scene_.assets());
  ASSERT_TRUE(compiled.ok());
  const std::vector<float> unlit = picture(*compiled, 0);
  EXPECT_EQ(std::ranges::all_of(unlit, [](float value) { return value == 0; }), method_needs_light(name));
  EXPECT_EQ(picture(compiled_, 1) != picture(compiled_, 0), method_bounces(name));
}

INSTANTIATE_TEST_SUITE_P(
    All, Methods,
    ::testing::Values(MethodCase{"path", {}}, MethodCase{"preview", {}}, MethodCase{"caustic:photons=3000", {}},
                      MethodCase{"caustic:photons=2000,radius=3",
                                 {"direct", "indirect", "caustic", "albedo", "normal", "depth", "id"}},
                      MethodCase{"vcm:photons=3000", {}},
                      MethodCase{"vcm:photons=1000,radius=4",
                                 {"direct", "indirect", "albedo", "normal", "features", "depth", "id"}},
                      MethodCase{"ppm:photons=3000", {}},
                      MethodCase{"ppm:photons=1000,radius=8", {"albedo", "normal", "depth", "id"}},
                      MethodCase{"photon-map:photons=3000", {}},
                      MethodCase{"photon-map:caustic,photons=3000", {"albedo", "normal", "depth", "id"}},
                      MethodCase{"ao:distance=100", {"albedo", "features", "depth"}}, MethodCase{"raycast", {}},
                      MethodCase{"whitted", {}}, MethodCase{"whitted:glass=0.3", {"albedo", "normal", "depth", "id"}},
                      MethodCase{"raycast:flat", {"albedo", "normal", "depth", "id"}},
                      MethodCase{"path", {"direct", "indirect", "albedo", "normal", "depth", "id"}},
                      MethodCase{"preview", {"albedo", "normal", "depth", "id"}}),
    [](const auto& info) {
      std::string name = info.param.name.substr(0, info.param.name.find(':'));
      std::erase(name, '-');
      return name + (info.param.layers.empty() ? "" : "WithLayers");
    });

TEST(Method, AnUnknownNameIsRefusedWithTheKnownNames) {
  const auto scene = test::TestScene(test::source_file("scenes/cornell-bench-balls.json"));
  auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
  ASSERT_TRUE(compiled.ok());
  const auto method = make_method(*compiled, {"pathh", 0, 0});
  EXPECT_EQ(message_of(method.status()),
            "unknown method 'pathh'. Did you mean 'path'? Known methods: auto, path, caustic, vcm, ppm, photon-map, "
            "preview, ao, raycast, whitted");
}

TEST(Method, ParametersAreCheckedByName) {
  EXPECT_EQ(parse_method("ao:distance=2.5")->distance, 2.5);
  EXPECT_TRUE(parse_method("ao:distance=2.5,brute-force")->brute_force);
  EXPECT_EQ(message_of(parse_method("path:brute-force=1").status()), "brute-force takes no value, got 'brute-force=1'");
  EXPECT_EQ(message_of(parse_method("ao:distance=far").status()),
            "distance: a number from 0 to 1000000000000 is expected, got 'far'");
  EXPECT_EQ(message_of(parse_method("ao:distance").status()),
            "distance: a number from 0 to 1000000000000 is expected, got ''");
  EXPECT_EQ(message_of(parse_method("ao:distance=0").status()),
            "distance: a number above 0 is expected, got '0'. Without it there is no limit");
  EXPECT_EQ(parse_method("ao")->distance, std::nullopt);
  EXPECT_EQ(message_of(parse_method("ao:depth=1").status()),
            "ao has no parameter 'depth'. Parameters: distance=D, brute-force");
  EXPECT_TRUE(parse_method("raycast:flat")->flat);
  EXPECT_EQ(message_of(parse_method("raycast:flat,flat").status()), "flat is given twice");
  EXPECT_EQ(message_of(parse_method("ao:distance=1,distance=2").status()), "distance is given twice");
  EXPECT_EQ(message_of(parse_method("raycast:flat=1").status()), "flat takes no value, got 'flat=1'");
  EXPECT_EQ(message_of(parse_method("raycast:smooth").status()),
            "raycast has no parameter 'smooth'. Parameters: flat, brute-force");
  EXPECT_EQ(parse_method("whitted:flat,glass=0.1")->glass, 0.1);
  EXPECT_EQ(parse_method("whitted")->glass, std::nullopt);
  EXPECT_EQ(message_of(parse_method("whitted:glass=10").status()), "glass: a number from 0 to 1 is expected, got '10'");
  EXPECT_EQ(parse_method("caustic:photons=5000,radius=0.5")->photons, 5000u);
  EXPECT_EQ(parse_method("caustic:photons=5000,radius=0.5")->radius, 0.5);
  EXPECT_EQ(parse_method("caustic")->photons, std::nullopt);
  EXPECT_TRUE(parse_method("ppm:no-absorption,photons=9")->no_absorption);
  EXPECT_TRUE(parse_method("photon-map:caustic")->caustic);
  EXPECT_EQ(message_of(parse_method("photon-map:radius=1").status()),
            "photon-map has no parameter 'radius'. Parameters: photons=N, caustic, no-absorption, brute-force");
  EXPECT_EQ(message_of(parse_method("caustic:photons=0").status()),
            "photons: a number from 1 to 4194304 is expected, got '0'");
  EXPECT_EQ(message_of(parse_method("caustic:photons=1.5").status()), "photons: a whole number is expected, got '1.5'");
  EXPECT_EQ(message_of(parse_method("caustic:radius=0").status()),
            "radius: a number from 0.01 to 1000 is expected, got '0'");
  EXPECT_EQ(message_of(parse_method("path:distance=1").status()),
            "path has no parameter 'distance'. Parameters: brute-force");
}

TEST(Method, RangesOfSharedSamplesFitTheHeldPasses) {
  EXPECT_EQ(shared_samples(*parse_method("path")), 0u);
  EXPECT_EQ(shared_samples(*parse_method("caustic:photons=1000")), 32u);
  EXPECT_EQ(shared_samples(*parse_method("ppm:photons=1000")), 32u);
  EXPECT_EQ(shared_samples(*parse_method("caustic")), 8u);  // 65536 photons at most
  EXPECT_EQ(shared_samples(*parse_method("caustic:photons=4000000")), 1u);
  EXPECT_EQ(level_at_a_time(*parse_method("path"), 4), 4u);
  EXPECT_EQ(level_at_a_time(*parse_method("vcm"), 4), 0u) << "the next tile finds the pass, however heavy";
}

TEST(Method, WhittedLimitsItsBounces) {
  EXPECT_TRUE(check_max_bounces("whitted", 0).ok());
  EXPECT_TRUE(check_max_bounces("whitted", kMaxWhittedBounces).ok());
  EXPECT_TRUE(check_max_bounces("path", kMaxBounces).ok());
  EXPECT_FALSE(check_max_bounces("path", kMaxBounces + 1).ok());
  const auto scene = test::TestScene(test::source_file("scenes/cornell-bench-balls.json"));
  auto compiled = CompiledScene::compile(scene.scene(), scene.assets());
  ASSERT_TRUE(compiled.ok()) << compiled.status();
  EXPECT_EQ(message_of(make_method(*compiled, {"whitted", 1, 129, {}}).status()),
            "whitted follows at most 128 bounces, got 129");
}

TEST(Fingerprint, IsTheSameEachTime) {
  EXPECT_EQ(fingerprint_class(), fingerprint_class());
}

/// A scene and its meshes.
struct SceneWithAssets {
  Scene scene;
  std::map<Sha256, std::string> assets;

  Node render(std::uint32_t level) const {
    auto compiled =
        CompiledScene::compile(scene, [&](const Sha256& digest) -> Result<std::string> { return assets.at(digest); });
    EXPECT_TRUE(compiled.ok()) << message_of(compiled.status());
    const auto method = make_method(*compiled, {"path", 1, 0});
    return (*method)->render({0, 0, 64, 64}, {level, 0}, *(*method)->make_workspace());
  }
};

/// The bench box with balls, 64×64, and a point light; each coordinate times `factor`, plus `offset`.
SceneWithAssets transformed_balls(double factor, double offset) {
  const auto original = test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(64, 64);
  SceneWithAssets out{original.scene(), {}};
  const auto transform = [&](std::array<double, 3>& p) {
    for (double& x : p) {
      x = x * factor + offset;
    }
  };
  transform(out.scene.camera.eye);
  transform(out.scene.camera.look_at);
  const auto intensity = static_cast<float>(100 * factor * factor);
  out.scene.lights.push_back({"point", PointLight{{100, 500, 100}, {intensity, intensity, intensity}}});
  transform(std::get<PointLight>(out.scene.lights.back().kind).position);
  for (Object& object : out.scene.objects) {
    if (auto* sphere = std::get_if<SphereShape>(&object.shape)) {
      transform(sphere->center);
      sphere->radius *= factor;
    } else {
      auto& shape = std::get<MeshShape>(object.shape);
      Mesh mesh = *decode_mesh(as_byte_view(*original.assets()(shape.asset)));
      for (auto& p : mesh.positions) {
        transform(p);
      }
      std::string bytes = encode_mesh(mesh);
      shape.asset = sha256(bytes);
      out.assets.emplace(shape.asset, std::move(bytes));
    }
  }
  return out;
}

// A power of two changes no mantissa. Compilation scales very large and very small scenes by a power of two.
TEST(Compile, AScaledSceneHasTheSameBits) {
  const Node reference = transformed_balls(1, 0).render(3);
  for (const double factor : {0x1p-60, 0x1p-40, 0x1p-30, 0x1p-10, 0x1p10, 0x1p24, 0x1p29}) {
    const Node node = transformed_balls(factor, 0).render(3);
    EXPECT_EQ(node.values, reference.values) << factor;
    EXPECT_EQ(node.non_finite, 0u) << factor;
  }
}

// Only the direction counts, even if `look_at` is close to the camera or `up` is short.
TEST(Compile, ShortCameraVectorsGiveTheSameView) {
  SceneWithAssets scene = transformed_balls(1, 0);
  scene.scene.camera.eye = {0, 0, 0};
  scene.scene.camera.look_at = {0, 0, 1};
  const Node reference = scene.render(1);
  scene.scene.camera.look_at = {0, 0, 0x1p-700};
  scene.scene.camera.up = {0, 0x1p-300, 0};
  EXPECT_EQ(scene.render(1).values, reference.values);
}

// A scene and camera that move far away look the same up to noise, because geometry is recentred in double precision.
TEST(Compile, AMovedSceneLooksTheSame) {
  const Node node = transformed_balls(1, 1e6).render(5);
  const Node reference = transformed_balls(1, 0).render(5);
  // At 1e6 doubles have a spacing of 1e-10. Paths stay the same, but for the rare one that rounding turns.
  double difference = 0, total = 0;
  for (std::size_t i = 0; i < node.values.size(); ++i) {
    difference += node.values[i] - reference.values[i];
    total += reference.values[i];
  }
  EXPECT_LT(std::abs(difference) / total, 1e-4);
}

}  // namespace
}  // namespace lightmill

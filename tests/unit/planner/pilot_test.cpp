#include "common/planner/pilot.h"

#include <gtest/gtest.h>

#include <set>

#include "common/planner/counted_cost.h"
#include "common/planner/emitter_radiance.h"
#include "tests/support/paths.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

class PilotRun : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const test::TestScene scene = test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(96, 80);
    compiled_ = *CompiledScene::compile(scene.scene(), scene.assets());
  }
  static void TearDownTestSuite() { compiled_.reset(); }
  static Result<PilotChoice> run(std::vector<std::string> methods, PixelRect film = {0, 0, 96, 80}) {
    return run_pilot(compiled_, {std::move(methods), 3, 0, film});
  }
  static std::shared_ptr<const CompiledScene> compiled_;
};
std::shared_ptr<const CompiledScene> PilotRun::compiled_;

TEST_F(PilotRun, TheFirstOfTwoEqualMethodsWins) {
  const Result<PilotChoice> made = run({"path", "path"});
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->choice, 0u);
  EXPECT_NE(made->reasons.at(0).find("needs 1.0 times the work"), std::string::npos) << made->reasons[0];
}

TEST_F(PilotRun, AStoppedRunReturnsCancelled) {
  std::stop_source source;
  source.request_stop();
  // All of these would take an hour.
  const PilotSettings settings{std::vector<std::string>(100'000, "path"), 3, 0, {0, 0, 96, 80}};
  EXPECT_EQ(run_pilot(compiled_, settings, source.get_token()).status().code(), StatusCode::kCancelled);
}

TEST_F(PilotRun, AMethodThatMissesLightIsRejected) {
  // In raycast only the ray's place in the pixel is random, so it would be the cheapest by far.
  EXPECT_EQ(run({"path", "raycast"})->choice, 0u);
  EXPECT_EQ(run({"raycast", "path"})->choice, 1u);
}

// Measured over 256 samples: path has about ten times the error × seconds of caustic here.
TEST_F(PilotRun, MirrorAndGlassUnderAnEmitterChooseCaustic) {
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    EXPECT_EQ(run_pilot(compiled_, {{"path", "caustic"}, seed, 0, {0, 0, 96, 80}})->choice, 1u) << seed;
  }
}

// The pixels of a 96×80 film share few photons, so eight times the photons are most of the work.
TEST_F(PilotRun, PhotonsCountAsWorkOfTheFilm) {
  EXPECT_EQ(run({"caustic:photons=4096", "caustic:photons=32768"})->choice, 0u);
  const auto method = make_method(compiled_, {"caustic:photons=3000", 1}).value();
  const auto workspace = method->make_workspace();
  method->render({0, 0, 8, 8}, {2, 16}, *workspace);
  const CountedCost one = cost_of(workspace->counters);
  EXPECT_EQ(workspace->counters.photons, 4u * 3000);
  EXPECT_GT(workspace->counters.photon_rays, workspace->counters.photons);
  EXPECT_GT(workspace->counters.stored_photons, 0u);
  method->render({40, 40, 8, 8}, {2, 16}, *workspace);
  const CountedCost two = cost_of(workspace->counters);
  EXPECT_EQ(two.shared, one.shared) << "passes are held for all patches";
  EXPECT_GT(two.own, one.own);
  EXPECT_GT(one.shared, 0);
}

/// A glass ball on a matte floor before a wall, and a distant emitter of this radiance and radius.
test::TestScene ball_under_an_emitter(double radiance, double radius) {
  return test::TestScene::from_text(fmt::format(R"({{
    "camera": {{"eye": [0, 1.6, 4], "look_at": [0, 0.5, 0], "vertical_fov_degrees": 35}},
    "film": {{"width": 96, "height": 72}},
    "materials": [
      {{"name": "floor", "diffuse": {{"reflectance": {{"rgb": [0.7, 0.7, 0.7]}}}}}},
      {{"name": "glass", "dielectric": {{"ior": 1.5}}}},
      {{"name": "lamp", "diffuse": {{"reflectance": {{"rgb": [0, 0, 0]}}}}, "emission": {{"rgb": [{0}, {0}, {1}]}}}}],
    "objects": [
      {{"material": "floor", "plane": {{"point": [0, 0, 0], "normal": [0, 1, 0]}}}},
      {{"material": "floor", "plane": {{"point": [0, 0, -2], "normal": [0, 0, 1]}}}},
      {{"material": "glass", "sphere": {{"center": [0.8, 0.3, 0.3], "radius": 0.3}}}},
      {{"material": "lamp", "sphere": {{"center": [-1.5, 3, 1], "radius": {2}}}}}]}})",
                                                radiance, radiance / 2, radius));
}

// Paths rarely meet so small an emitter by way of the ball, so a pilot meets few or none. Over 64 samples a pixel path
// had 39 times the relMSE × seconds of caustic (tests/bench/planner_bench).
TEST(Pilot, LightThatPathRarelyFindsIsForeseen) {
  const test::TestScene scene = ball_under_an_emitter(400, 0.1);
  const auto compiled = *CompiledScene::compile(scene.scene(), scene.assets());
  for (const std::uint64_t seed : {1u, 2u, 3u}) {
    const Result<PilotChoice> made = run_pilot(compiled, {{"path", "caustic"}, seed, 0, {0, 0, 96, 72}});
    ASSERT_TRUE(made.ok()) << made.status();
    EXPECT_EQ(made->choice, 1u) << made->reasons.at(0);
  }
}

TEST(Pilot, ShownRadianceIsTheEmittersRadiance) {
  const test::TestScene scene = ball_under_an_emitter(40, 0.1);
  const Vec3 radiance = emitter_radiance_in_casters(**CompiledScene::compile(scene.scene(), scene.assets()));
  EXPECT_NEAR(radiance.x, 40, 1e-3);
  EXPECT_NEAR(radiance.y, 40, 1e-3);
  EXPECT_NEAR(radiance.z, 20, 1e-3);
  const test::TestScene dark = ball_under_an_emitter(0, 0.1);
  EXPECT_EQ(emitter_radiance_in_casters(**CompiledScene::compile(dark.scene(), dark.assets())), Vec3{0});
}

/// A rough metal ball, alone under a light of the document or an emitter of radius 3 and radiance 2 above it.
std::shared_ptr<const CompiledScene> metal_ball(double roughness, const std::string& light, double emitter_y = 1e6) {
  const test::TestScene scene = test::TestScene::from_text(fmt::format(R"({{
    "camera": {{"eye": [0, 1, 4], "look_at": [0, 0.5, 0], "vertical_fov_degrees": 40}},
    "film": {{"width": 8, "height": 8}},
    "materials": [
      {{"name": "metal", "conductor": {{"metal": "gold", "roughness": {}}}}},
      {{"name": "lamp", "diffuse": {{"reflectance": {{"rgb": [0, 0, 0]}}}}, "emission": {{"rgb": [2, 2, 2]}}}}],
    "objects": [
      {{"material": "metal", "sphere": {{"center": [0, 0.5, 0], "radius": 0.5}}}}{}],
    "lights": [{}]}})",
                                                                       roughness,
                                                                       emitter_y > 1e5 ? ""
                                                                                       : fmt::format(R"(,
      {{"material": "lamp", "sphere": {{"center": [0, {}, 0], "radius": 3}}}})",
                                                                                                     emitter_y),
                                                                       light));
  return *CompiledScene::compile(scene.scene(), scene.assets());
}

// The lobe of a ball's side, alpha = .59 · .3²: the mean of its density, weighted with itself, is ∫ K² = 1/(12π alpha²).
TEST(Pilot, ARoughCasterSpreadsTheSunOverItsLobe) {
  const auto sun = metal_ball(0.3, R"({"directional": {"direction": [1, -2, -1], "irradiance": {"rgb": [3, 2, 1]}}})");
  const double alpha = 0.59 * 0.09, brightness = 1 / (12 * 3.14159265 * alpha * alpha);
  const Vec3 shown = emitter_radiance_in_casters(*sun);
  EXPECT_NEAR(shown.x, 3 * brightness, 0.01 * brightness);
  EXPECT_NEAR(shown.y, 2 * brightness, 0.01 * brightness);
  EXPECT_NEAR(shown.z, 1 * brightness, 0.01 * brightness);
}

// A lobe much narrower than the emitter shows its radiance. A wide lobe shows at most that.
TEST(Pilot, RoughCastersShowAtMostTheEmittersRadiance) {
  for (const double roughness : {0.02, 0.1, 0.2}) {
    const float shown = emitter_radiance_in_casters(*metal_ball(roughness, "", 6)).x;
    EXPECT_LE(shown, 2.0001f) << roughness;
    EXPECT_GT(shown, 1.5f) << roughness;
  }
  // The emitter fills π · 3²/100² of the directions, a hundredth of what the lobe spreads over: 12π alpha² = .106.
  const float far = emitter_radiance_in_casters(*metal_ball(0.3, "", 100)).x;
  EXPECT_NEAR(far, 2 * 3.1416 * 9 / 10000 / 0.1063, 0.1 * far);
}

// By relMSE × seconds of 256 samples, path takes 30 times the work of caustic in the first two. In the last it takes
// half, because the emitter is as wide as the gold's lobe (tests/bench/planner_bench).
TEST(Pilot, FirefliesOfRoughMetalsAreForeseen) {
  for (const auto& [name, best] :
       {std::pair("sun-on-rough-gold", 1u), {"bulb-by-coated-metal", 1u}, {"rough-gold", 0u}}) {
    const test::TestScene scene =
        test::TestScene(test::source_file(fmt::format("tests/bench/choices/{}.json", name))).resized(96, 72);
    const auto compiled = *CompiledScene::compile(scene.scene(), scene.assets());
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
      const Result<PilotChoice> made = run_pilot(compiled, {{"path", "caustic"}, seed, 0, {0, 0, 96, 72}});
      ASSERT_TRUE(made.ok()) << made.status();
      EXPECT_EQ(made->choice, best) << name << ": " << made->reasons.at(0);
    }
  }
}

TEST_F(PilotRun, IsAFunctionOfItsArguments) {
  const Result<PilotChoice> once = run({"path", "whitted"}), again = run({"path", "whitted"});
  ASSERT_TRUE(once.ok() && again.ok());
  EXPECT_EQ(once->choice, again->choice);
  EXPECT_EQ(once->reasons, again->reasons);
  EXPECT_NE(run({"path", "whitted"}, {10, 20, 30, 9})->reasons, once->reasons) << "each film has patches of its own";
}

TEST_F(PilotRun, ErrorsNameTheMethod) {
  const Status status = run({"path", "magic"}).status();
  EXPECT_EQ(status.code(), StatusCode::kInvalidArgument);
  EXPECT_NE(message_of(status).find("magic"), std::string::npos);
  EXPECT_FALSE(run({}).ok());
}

TEST(PilotPatches, LieInTheFilmWithoutOverlap) {
  for (const PixelRect& film : {PixelRect{0, 0, 512, 512}, PixelRect{0, 0, 1, 1}, PixelRect{7, 9, 7, 130},
                                PixelRect{60, 60, 65, 63}, PixelRect{0, 0, 65536, 3}}) {
    const std::vector<PixelRect> patches = pilot_patches(film);
    ASSERT_FALSE(patches.empty());
    EXPECT_LE(patches.size(), 64u);
    std::set<std::pair<int, int>> pixels;
    std::size_t count = 0;
    for (const PixelRect& patch : patches) {
      EXPECT_GE(patch.x, film.x);
      EXPECT_GE(patch.y, film.y);
      EXPECT_LE(patch.x + patch.width, film.x + film.width);
      EXPECT_LE(patch.y + patch.height, film.y + film.height);
      EXPECT_LE(std::max(patch.width, patch.height), 8);
      count += static_cast<std::size_t>(patch.pixel_count());
      for (int y = 0; y < patch.height; ++y) {
        for (int x = 0; x < patch.width; ++x) {
          pixels.emplace(patch.x + x, patch.y + y);
        }
      }
    }
    EXPECT_EQ(pixels.size(), count);
    EXPECT_EQ(count, std::min<std::size_t>(64, static_cast<std::size_t>(film.width)) *
                         std::min<std::size_t>(64, static_cast<std::size_t>(film.height)));
  }
}

}  // namespace
}  // namespace lightmill

// Memory of photon passes and of a batch of `vcm`.
#include <gtest/gtest.h>

#include "common/methods/factories.h"
#include "common/methods/photons/gather_pass.h"
#include "common/methods/vcm/light_path_pass.h"
#include "tests/analytic/scene_text.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

constexpr double kPower = 4 * M_PI * M_PI;  ///< of the room's light

/// A point light of intensity π in the middle of a diffuse sphere. No light leaves the sphere.
TestScene closed_room(double albedo, int film_side) {
  return TestScene::from_text(
      document(kInside, 60, film_side, diffuse("wall", albedo), sphere("wall", "[0, 0, 0]", 1, true),
               R"({"point": {"position": [0, 0, 0], "intensity": {"rgb": [3.14159265, 3.14159265, 3.14159265]}}})"));
}

vcm::LightPathPasses passes_of(const TestScene& scene, std::uint64_t seed, std::uint32_t light_paths = 0) {
  return vcm::LightPathPasses(*scene.compiled(), {vcm::kLightPaths, seed, kDefaultBounces, light_paths});
}

TEST(VcmMemory, TracingConnectionsInPiecesDoesNotChangeBits) {
  const auto scene = TestScene(source_file("scenes/cornell-bench-balls.json")).resized(64, 64);
  const MethodSettings settings{"vcm:photons=1000", 42, 0,
                                *film_layers(std::vector<std::string>{"direct", "indirect"})};
  const auto values = [&](std::uint32_t connections_at_once) {
    const auto method = make_vcm_method(scene.compiled(), settings, *parse_method(settings.name), connections_at_once);
    return method->render({0, 0, 64, 64}, {1, 0}, *method->make_workspace()).values;
  };
  const std::vector<float> whole = values(1u << 20);
  for (const std::uint32_t piece : {1u, 13u, 64u, 4096u, vcm::kConnectionsAtOnce}) {
    EXPECT_EQ(values(piece), whole) << piece << " at once";
  }
}

/// Number of vertices of light paths that continue with the albedo's probability, up to 1000 vertices: geometric.
struct Vertices {
  double mean, variance;  ///< of a path; the variance is an upper bound, without the limit
};
Vertices vertices_of(double albedo) {
  if (albedo == 1) {
    return {kDefaultBounces, 0};
  }
  return {(1 - std::pow(albedo, kDefaultBounces)) / (1 - albedo), albedo / ((1 - albedo) * (1 - albedo))};
}

// 2^16 paths of 512×512 pixels would have 6.5 and 65 million vertices. The number from trial paths is lowered by three
// standard errors, and can be off by three more. A pass with less than 0.75 of the limit, or above it, occurs once in
// 100,000.
TEST(VcmMemory, APassInAClosedRoomNearlyFillsTheVertexLimit) {
  for (const double albedo : {0.99, 1.0}) {
    const TestScene scene = closed_room(albedo, 512);
    RenderCounters counters;
    const auto pass = passes_of(scene, 7).trace(0, counters);
    const Vertices of_path = vertices_of(albedo);
    EXPECT_LE(pass->plan.photons * of_path.mean, photons::kMaxStored) << albedo;
    EXPECT_GE(pass->plan.photons * of_path.mean, 0.75 * photons::kMaxStored) << albedo;
    EXPECT_NEAR(static_cast<double>(pass->photons.size()), pass->plan.photons * of_path.mean,
                5 * std::sqrt(of_path.variance * pass->plan.photons) + 1)
        << albedo;
    EXPECT_LT(pass->bytes(), 160u << 20) << albedo;
    EXPECT_EQ(pass->path_first.size(), pass->plan.photons + 1u) << "one for each path, and the end";
  }
}

// The same for gathered photons. A photon stays at every wall that its path meets.
TEST(PhotonMemory, APassInAClosedRoomStaysWithinThePhotonLimit) {
  for (const double albedo : {0.99, 1.0}) {
    const TestScene scene = closed_room(albedo, 512);
    RenderCounters counters;
    const photons::GatherPasses side(*scene.compiled(), {photons::kGlobalPhotons, 7, kDefaultBounces});
    EXPECT_LT(side.photons(), photons::default_photons(*scene.compiled(), photons::kGlobalPhotons));
    const auto pass = side.trace(0, counters);
    const Vertices of_path = vertices_of(albedo);
    EXPECT_LE(side.photons() * of_path.mean, photons::kMaxStored) << albedo;
    EXPECT_NEAR(static_cast<double>(pass->photons.size()), side.photons() * of_path.mean,
                5 * std::sqrt(of_path.variance * side.photons()) + 1)
        << albedo;
    EXPECT_LT(pass->bytes(), 110u << 20) << albedo;
  }
}

TEST(VcmMemory, ShortLightPathsKeepTheirRequestedNumber) {
  EXPECT_EQ(passes_of(closed_room(0.5, 512), 7).photons(), 1u << 16) << "of 512×512 pixels";
  const TestScene five_each = closed_room(0.8, 16);
  EXPECT_EQ(passes_of(five_each, 7, 150'000).photons(), 150'000u);
  EXPECT_LT(passes_of(five_each, 7, 300'000).photons() * 5, photons::kMaxStored);
}

TEST(VcmMemory, TheNumberOfLightPathsDependsOnTheSceneNotTheSeed) {
  const TestScene scene = closed_room(0.99, 512);
  EXPECT_EQ(passes_of(scene, 1).photons(), passes_of(scene, 2).photons());
}

// After k − 1 scatterings the light's power times albedo^(k − 1) arrives, with any number of paths.
TEST(VcmMemory, FewerPathsCarryAllLight) {
  constexpr double kAlbedo = 0.97;
  const TestScene scene = closed_room(kAlbedo, 512);
  RenderCounters counters;
  const auto pass = passes_of(scene, 7).trace(0, counters);
  ASSERT_LT(pass->plan.photons, 1u << 16) << "else they are not fewer";
  std::map<std::uint32_t, double> power;  // by scatterings
  for (const photons::Photon& photon : pass->photons) {
    power[photon.tag & photons::kMaxScatterings] += photon.power.x;
  }
  for (const std::uint32_t k : {1u, 2u, 5u, 20u, 50u}) {
    const double left = std::pow(kAlbedo, k - 1);  // roulette keeps a path with this probability, at full power
    const double relative_error = std::sqrt((1 - left) / (left * pass->plan.photons));
    EXPECT_NEAR(power[k], kPower * left, (5 * relative_error + 1e-4) * kPower * left) << k;
  }
}

}  // namespace
}  // namespace lightmill::test

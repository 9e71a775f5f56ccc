// The thread that prepares jobs and runs pilots.
#include "worker/render/preparer.h"
#include "tests/support/paths.h"

#include <gtest/gtest.h>

#include <ctime>

#include "common/scene/compiled/scene_memory.h"
#include "common/scene/mesh.h"
#include "common/wire/scene_proto.h"
#include "tests/support/process.h"
#include "tests/support/render_document.h"

namespace lightmill {
namespace {

class PreparerTest : public ::testing::Test {
 protected:
  PreparerTest() {
    settings_.scene = pack_scene(scene_.scene());
    settings_.width = 96;
    settings_.height = 80;
    settings_.crop = {0, 0, 96, 80};
    settings_.renderer_version = kRendererVersion;
  }
  std::shared_ptr<const PilotGrant> pilot(std::uint64_t lease, std::size_t methods = 2) const {
    return std::make_shared<PilotGrant>(
        PilotGrant{LeaseId{lease}, JobId{lease}, settings_, std::vector<std::string>(methods, "path")});
  }
  /// A pilot that would take an hour.
  std::shared_ptr<const PilotGrant> endless(std::uint64_t lease) const { return pilot(lease, 100'000); }
  std::shared_ptr<const JobDescription> job(std::uint64_t id) const {
    return std::make_shared<JobDescription>(JobDescription{JobId{id}, {}, settings_});
  }
  std::unique_ptr<Preparer> make() {
    return std::make_unique<Preparer>(
        assets_, SceneCacheLimits{}, SceneLimits{}, DecoderOptions{},
        [this](std::shared_ptr<const JobDescription> description, Result<PreparedJob> prepared) {
          const MutexLock lock(mutex_);
          EXPECT_TRUE(prepared.ok()) << prepared.status();
          prepared_.push_back(std::move(description));
          changed_.notify_one();
        },
        [this](LeaseId lease, Result<PilotReport> report) {
          const MutexLock lock(mutex_);
          EXPECT_TRUE(report.ok()) << report.status();
          reported_.push_back(lease);
          changed_.notify_one();
        });
  }
  void wait_for_report() {
    const MutexLock lock(mutex_);
    while (reported_.empty()) {
      changed_.wait(mutex_);
    }
  }

  /// Waits until the preparer's thread has used CPU time, so that a pilot may be running.
  static void wait_until_it_computes() {
    const std::clock_t before = std::clock();
    EXPECT_TRUE(test::eventually([&] { return std::clock() - before > CLOCKS_PER_SEC / 20; }));
  }

  const test::TestScene scene_ = test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(96, 80);
  RenderSettings settings_;
  AssetCache assets_{scene_.assets(), 1 << 20};
  Mutex mutex_;
  CondVar changed_;
  std::vector<LeaseId> reported_;
  std::vector<std::shared_ptr<const JobDescription>> prepared_;
};

TEST_F(PreparerTest, DroppedPilotsAreStoppedAndNotReported) {
  const std::unique_ptr<Preparer> preparer = make();
  preparer->add(endless(1));
  preparer->add(endless(2));
  preparer->add(pilot(3));
  wait_until_it_computes();
  preparer->drop(LeaseId{1});
  preparer->drop(LeaseId{2});
  wait_for_report();
  EXPECT_EQ(reported_, std::vector<LeaseId>{LeaseId{3}});
}

TEST_F(PreparerTest, OnlyTheLastDescriptionOfAJobIsPrepared) {
  const std::unique_ptr<Preparer> preparer = make();
  preparer->add(endless(1));
  const std::shared_ptr<const JobDescription> last = job(7);
  preparer->add(job(7));
  preparer->add(job(8));
  preparer->add(job(7));
  preparer->add(last);
  preparer->drop(JobId{8});
  preparer->add(pilot(2));
  preparer->drop(LeaseId{1});
  wait_for_report();
  ASSERT_EQ(prepared_.size(), 1u);
  EXPECT_EQ(prepared_[0], last);
}

TEST_F(PreparerTest, ReportsTheCpuTimeOfTheRunningPilot) {
  const std::unique_ptr<Preparer> preparer = make();
  EXPECT_FALSE(preparer->pilot_at_work());
  preparer->add(endless(1));
  preparer->add(endless(2));
  double seconds = 0;
  EXPECT_TRUE(test::eventually([&] {
    const std::optional<std::pair<LeaseId, double>> pilot = preparer->pilot_at_work();
    EXPECT_TRUE(!pilot || pilot->first == LeaseId{1}) << "the other one waits";
    seconds = pilot ? pilot->second : 0;
    return seconds > 0.05;
  }));
  preparer->drop(LeaseId{1});
  EXPECT_TRUE(test::eventually([&] {
    const std::optional<std::pair<LeaseId, double>> pilot = preparer->pilot_at_work();
    return pilot && pilot->first == LeaseId{2};
  }));
  EXPECT_LT(preparer->pilot_at_work()->second, 60) << "each one has a time of its own";
}

TEST_F(PreparerTest, DestructionDoesNotWaitForAPilot) {
  std::unique_ptr<Preparer> preparer = make();
  preparer->add(endless(1));
  wait_until_it_computes();
  preparer.reset();
  EXPECT_TRUE(reported_.empty());
}

/// A preparer whose assets arrive when the test says so.
class SlowAssets : public PreparerTest {
 protected:
  /// A job whose scene has so many images. No image can be decoded.
  std::shared_ptr<const JobDescription> job_with_images(std::uint64_t id, std::size_t images) const {
    Scene scene;
    scene.materials.emplace_back().name = "grey";
    scene.objects.push_back({"ball", 0, SphereShape{}});
    for (std::size_t i = 0; i < images; ++i) {
      TextureImage& image = scene.textures.emplace_back();
      image.name = image.file = fmt::format("image {}", i);
      image.asset = sha256(image.name);
    }
    RenderSettings settings = settings_;
    settings.scene = pack_scene(scene);
    return std::make_shared<JobDescription>(JobDescription{JobId{id}, {}, settings});
  }
  Result<std::string> fetch(const Sha256& digest) {
    const MutexLock lock(mutex_);
    const std::string text = fmt::format("image {}", fetched_++);
    EXPECT_EQ(sha256(text), digest);
    changed_.notify_one();
    while (!open_) {
      changed_.wait(mutex_);
    }
    return text;
  }
  void wait_for_first_fetch() {
    const MutexLock lock(mutex_);
    while (fetched_ == 0) {
      changed_.wait(mutex_);
    }
  }
  void open_and_wait_for(std::size_t results) {
    const MutexLock lock(mutex_);
    open_ = true;
    changed_.notify_all();
    while (results_.size() < results) {
      changed_.wait(mutex_);
    }
  }

  std::size_t fetched_ = 0;
  bool open_ = false;
  SceneLimits limits_;
  AssetCache slow_assets_{[this](const Sha256& digest) { return fetch(digest); }, 1 << 20};
  std::vector<std::pair<JobId, Status>> results_;
  std::optional<Preparer> preparer_;
  void start() {
    preparer_.emplace(
        slow_assets_, SceneCacheLimits{}, limits_, DecoderOptions{.program = test::program("lightmill-image-decoder")},
        [this](const std::shared_ptr<const JobDescription>& description, const Result<PreparedJob>& prepared) {
          const MutexLock lock(mutex_);
          results_.emplace_back(description->job, prepared.status());
          changed_.notify_all();
        },
        [](LeaseId, const Result<PilotReport>&) {});
  }
};

TEST_F(SlowAssets, ADroppedSceneMakesWayForTheNext) {
  start();
  preparer_->add(job_with_images(1, 10));
  wait_for_first_fetch();
  preparer_->drop(JobId{1});
  preparer_->add(job_with_images(2, 0));
  open_and_wait_for(1);
  EXPECT_EQ(results_[0].first, JobId{2});
  EXPECT_EQ(fetched_, 1u);
}

TEST_F(SlowAssets, ADroppedSceneThatIsNeededAgainIsPreparedToTheEnd) {
  start();
  preparer_->add(job_with_images(1, 3));
  wait_for_first_fetch();
  preparer_->drop(JobId{1});
  preparer_->add(job_with_images(1, 3));
  open_and_wait_for(2);
  EXPECT_EQ(fetched_, 3u) << "all, and each once";
  EXPECT_EQ(results_[0].second.code(), StatusCode::kInvalidArgument) << results_[0].second;
}

TEST_F(SlowAssets, ASceneThatTakesTooLongIsLeftToOthers) {
  limits_.seconds = 0;
  open_ = true;
  start();
  preparer_->add(job_with_images(1, 10));
  open_and_wait_for(1);
  EXPECT_EQ(results_[0].second.code(), StatusCode::kResourceExhausted);
  EXPECT_EQ(message_of(results_[0].second),
            "the scene takes longer to prepare than --scene-seconds 0 of this worker allows");
}

// The size of the finished scene is known to the byte. Compilation takes more, but not a multiple.
TEST(SceneMemory, IsPredictedWithinAFactorAndNamesTheLargestPart) {
  constexpr std::uint32_t kSide = 300;
  Mesh mesh;
  for (std::uint32_t i = 0; i <= kSide; ++i) {
    for (std::uint32_t j = 0; j <= kSide; ++j) {
      mesh.positions.push_back({i * 1.0, j * 1.0, (i * j) % 7 * 0.1});
    }
  }
  for (std::uint32_t i = 0; i < kSide; ++i) {
    for (std::uint32_t j = 0; j < kSide; ++j) {
      const std::uint32_t at = i * (kSide + 1) + j;
      mesh.triangles.push_back({at, at + 1, at + kSide + 2});
      mesh.triangles.push_back({at, at + kSide + 2, at + kSide + 1});
    }
  }
  const std::string bytes = encode_mesh(mesh);
  Scene scene;
  scene.materials.emplace_back().name = "grey";
  scene.objects.push_back({"ball", 0, SphereShape{}});
  scene.objects.push_back({"hills", 0, MeshShape{"hills.obj", sha256(bytes)}});
  const auto assets = [&](const Sha256&) -> Result<std::string> { return bytes; };
  const auto no_images = [](ByteView, const std::string&) { return Result<ImageSize>(ImageSize{}); };
  const Result<SceneMemory> estimated = estimate_memory(scene, assets, no_images);
  ASSERT_TRUE(estimated.ok()) << estimated.status();
  EXPECT_EQ(estimated->triangles, 2u * kSide * kSide);
  EXPECT_EQ(estimated->largest, "objects[1] \"hills\"");
  const auto compiled = CompiledScene::compile(scene, assets);
  ASSERT_TRUE(compiled.ok()) << compiled.status();
  const auto held = static_cast<double>((*compiled)->bytes());
  EXPECT_GT(static_cast<double>(estimated->bytes), held);
  EXPECT_LT(static_cast<double>(estimated->bytes), 3 * held);
  // A header that promises more than the file has is not trusted.
  const std::string lie = bytes.substr(0, 4) + std::string(4, '\0') + std::string(8, '\xff') + "short";
  const auto liar = [&](const Sha256&) -> Result<std::string> { return lie; };
  EXPECT_LT(estimate_memory(scene, liar, no_images)->bytes, std::uint64_t{32} << 20);
}

// A mesh with tangents but no texture coordinates has a table of derivatives, too.
TEST(SceneMemory, TheDirectionsOfAnisotropicMeshesAreEstimated) {
  Mesh mesh;
  mesh.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.tangents.assign(3, {1, 0, 0, 1});
  mesh.triangles.assign(1000, {0, 1, 2});
  const std::string bytes = encode_mesh(mesh);
  const auto assets = [&](const Sha256&) -> Result<std::string> { return bytes; };
  const auto no_images = [](ByteView, const std::string&) { return Result<ImageSize>(ImageSize{}); };
  Scene scene;
  scene.materials = {{"metal", ConductorMaterial{.roughness = 0.5}, {}}};
  scene.objects.push_back({"wall", 0, MeshShape{"wall.glb", sha256(bytes)}});
  Scene brushed = scene;
  brushed.materials[0].kind = ConductorMaterial{.roughness = 0.5, .anisotropy = {0.5, 0}};
  const std::uint64_t held = (*CompiledScene::compile(scene, assets))->bytes(),
                      held_brushed = (*CompiledScene::compile(brushed, assets))->bytes();
  EXPECT_GE(held_brushed, held + 1000 * 32);
  EXPECT_GE(estimate_memory(brushed, assets, no_images)->bytes,
            estimate_memory(scene, assets, no_images)->bytes + (held_brushed - held));
}

// Files are read one after the other, each with a copy for the decoder.
TEST_F(PreparerTest, TheMemoryOfAScenesFilesAndLightsIsEstimated) {
  const std::string padded(std::size_t{32} << 20, 'x'), small(1000, 's');
  const Sha256 of_padded = sha256(padded), of_small = sha256(small);
  const auto assets = [&](const Sha256& digest) -> Result<std::string> { return digest == of_padded ? padded : small; };
  const auto tiny = [](ByteView, const std::string&) { return Result<ImageSize>(ImageSize{16, 16, 4, {}}); };
  const auto bytes_of = [&](const Scene& scene) { return estimate_memory(scene, assets, tiny)->bytes; };
  Scene scene;
  const std::uint64_t empty = bytes_of(scene);
  scene.textures.push_back({"padded", "padded.tif", of_padded});
  scene.textures.push_back({"small", "small.tif", of_small});
  // Each image in its format and decoded, its smaller copies, and two of them in single precision.
  constexpr std::uint64_t kImage = 16 * 16 * 8 + (64 + 16 + 4 + 1) * 4 + (64 + 16) * 16;
  EXPECT_EQ(bytes_of(scene), empty + 2 * padded.size() + 2 * kImage);
  EXPECT_EQ(estimate_memory(scene, assets, tiny)->largest, "the file of the texture \"padded.tif\"");
  Scene lit;
  for (int i = 0; i < 10'000; ++i) {
    lit.lights.emplace_back();
  }
  EXPECT_GE(bytes_of(lit), empty + 10'000 * sizeof(Light));
  Scene measured;
  IesLight ies;
  ies.asset = of_padded;
  measured.lights.push_back({"lamp", ies});
  EXPECT_GE(bytes_of(measured), empty + 2 * padded.size());
}

TEST_F(PreparerTest, ATooLargeSceneIsRefusedByNameAndTheNextIsPrepared) {
  const auto prepared_with = [&](const SceneLimits& limits) {
    Status status;
    bool done = false;
    Preparer preparer(
        assets_, SceneCacheLimits{}, limits, DecoderOptions{},
        [&](const std::shared_ptr<const JobDescription>&, const Result<PreparedJob>& prepared) {
          const MutexLock lock(mutex_);
          status = prepared.status();
          done = true;
          changed_.notify_one();
        },
        [](LeaseId, const Result<PilotReport>&) {});
    preparer.add(job(1));
    const MutexLock lock(mutex_);
    while (!done) {
      changed_.wait(mutex_);
    }
    return status;
  };
  const Status refused = prepared_with({.bytes = 1000});
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(message_of(refused).starts_with("the scene takes about ")) << refused;
  EXPECT_NE(message_of(refused).find("more than --scene-gib"), std::string::npos) << refused;
  EXPECT_TRUE(prepared_with({.bytes = std::uint64_t{1} << 30}).ok());
}

}  // namespace
}  // namespace lightmill

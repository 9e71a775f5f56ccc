// Memory and threads that run out while a worker prepares or renders.
#include <gtest/gtest.h>

#include <future>
#include <thread>

#include "common/base/sanitizers.h"
#include "common/scene/mesh.h"
#include "common/wire/scene_proto.h"
#include "tests/support/little_memory.h"
#include "tests/support/paths.h"
#include "tests/support/render_document.h"
#include "worker/render/preparer.h"
#include "worker/render/render_pool.h"
#include "worker/render/scene_limits.h"

namespace lightmill {
namespace {

constexpr int kFilmSide = 64;

/// Exit codes of the children.
enum { kAllDone, kLarge, kWrong };

/// Runs the child with more and more memory, from `least_mib` on, until it does everything. With less, the child must
/// report what it lacks and do the small work.
void expect_small_work_is_done(const std::function<int()>& child, std::uint64_t least_mib, std::uint64_t step_mib) {
  if (kSanitized) {
    GTEST_SKIP() << "address space cannot be limited under a sanitizer";
  }
  int result = kLarge, ended = 0;
  for (std::uint64_t mib = least_mib; result == kLarge && mib < 4096; mib += step_mib) {
    result = test::run_in_little_memory(mib << 20, child);
    ended += result == kLarge ? 1 : 0;
    EXPECT_TRUE(result == kLarge || result == kAllDone) << result << " with " << mib << " MiB";
  }
  EXPECT_EQ(result, kAllDone) << "with enough memory";
  EXPECT_GE(ended, 3);
}

bool says_out_of_memory(const std::string& text) {
  return text.starts_with("out of memory while ") && text.find("this worker may use") != std::string::npos;
}

const test::TestScene& small_scene() {
  static const test::TestScene scene =
      test::TestScene(test::source_file("scenes/cornell-bench-balls.json")).resized(kFilmSide, kFilmSide);
  return scene;
}

std::shared_ptr<const Method> method_of(const std::string& name) {
  Result<std::unique_ptr<Method>> made = make_method(small_scene().compiled(), {.name = name, .seed = 5});
  EXPECT_TRUE(made.ok()) << made.status();
  return std::move(made).value();
}

TEST(OutOfMemory, FailsOneTileAndOthersAreRendered) {
  // Two threads trace a large photon pass each.
  const std::shared_ptr<const Method> large = method_of("ppm:photons=100000"), small = method_of("path");
  const std::unique_ptr<Workspace> workspace = small->make_workspace();
  const PixelRect rect{0, 0, kFilmSide, kFilmSide};
  const Hash128 expected = hash_of(small->render(rect, {1, 0}, *workspace));
  const auto child = [&] {
    std::array<std::promise<RenderedTile>, 5> done;
    RenderPool pool(2, [&](RenderedTile tile) { done.at(tile.ticket).set_value(std::move(tile)); });
    const auto tile = [&](std::uint64_t ticket) { return done.at(ticket).get_future().get(); };
    for (std::uint32_t i = 0; i < 4; ++i) {
      pool.add({i, {0, i % 2}, rect, large});
    }
    int result = kAllDone;
    for (std::uint32_t i = 0; i < 4; ++i) {
      if (const RenderedTile each = tile(i); !each.lacks.empty()) {
        result = says_out_of_memory(each.lacks) && each.node.values.empty() ? kLarge : kWrong;
      }
    }
    pool.add({4, {1, 0}, rect, small});
    return tile(4).hash == expected ? result : kWrong;
  };
  expect_small_work_is_done(child, 32, 8);
}

// If one large job fits, so does the next one, although the first job's scene is kept.
TEST(OutOfMemory, FailsOneJobAndOthersArePrepared) {
  constexpr std::uint32_t kSquares = 500;
  Mesh mesh;
  for (std::uint32_t i = 0; i <= kSquares; ++i) {
    for (std::uint32_t j = 0; j <= kSquares; ++j) {
      mesh.positions.push_back({i * 1.0, j * 1.0, (i * j) % 7 * 0.1});
    }
  }
  for (std::uint32_t i = 0; i < kSquares; ++i) {
    for (std::uint32_t j = 0; j < kSquares; ++j) {
      const std::uint32_t at = i * (kSquares + 1) + j;
      mesh.triangles.push_back({at, at + 1, at + kSquares + 2});
    }
  }
  const std::string bytes = encode_mesh(mesh);
  Scene hills;
  hills.materials.emplace_back().name = "grey";
  hills.objects.push_back({"hills", 0, MeshShape{"hills.obj", sha256(bytes)}});
  const auto job = [](std::uint64_t id, const Scene& scene) {
    RenderSettings settings;
    settings.scene = pack_scene(scene);
    settings.width = settings.height = kFilmSide;
    settings.crop = {0, 0, kFilmSide, kFilmSide};
    settings.renderer_version = kRendererVersion;
    return std::make_shared<JobDescription>(JobDescription{JobId{id}, {}, settings});
  };
  const auto large = job(1, hills), small = job(2, small_scene().scene());
  hills.materials[0].name = "white";
  const auto next = job(3, hills);
  const auto small_assets = small_scene().assets();
  const auto child = [&] {
    AssetCache assets([&](const Sha256& digest) { return digest == sha256(bytes) ? bytes : small_assets(digest); },
                      1 << 30);
    std::array<std::promise<Status>, 4> done;
    Preparer preparer(
        assets, SceneCacheLimits{}, SceneLimits{}, DecoderOptions{},
        [&](const std::shared_ptr<const JobDescription>& description, const Result<PreparedJob>& prepared) {
          done.at(description->job.value).set_value(prepared.status());
        },
        [](LeaseId, const Result<PilotReport>&) {});
    preparer.add(large);
    preparer.add(next);
    preparer.add(small);
    const auto status = [&](std::size_t id) { return done[id].get_future().get(); };
    const Status of_large = status(1), of_next = status(3), of_small = status(2);
    if (!of_small.ok() || of_large.code() != of_next.code()) {
      return kWrong;
    }
    const bool refused = of_large.code() == StatusCode::kResourceExhausted && says_out_of_memory(message_of(of_large));
    return of_large.ok() ? kAllDone : refused ? kLarge : kWrong;
  };
  expect_small_work_is_done(child, 24, 8);
}

TEST(OutOfThreads, IsReportedWithARemedy) {
  const Result<int> result = within_limits("the scene was prepared", []() -> Result<int> {
    throw std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again));
  });
  EXPECT_EQ(result.status().code(), StatusCode::kResourceExhausted);
  EXPECT_NE(message_of(result.status()).find("while the scene was prepared"), std::string::npos) << result.status();
  EXPECT_NE(message_of(result.status()).find("pids.max"), std::string::npos) << result.status();
}

TEST(OutOfThreads, APoolThatCannotStartAllThreadsEndsTheStartedOnes) {
  if (kSanitized) {
    GTEST_SKIP() << "address space cannot be limited under a sanitizer";
  }
  // Each thread takes 8 MiB of address space for its stack.
  const int result = test::run_in_little_memory(std::uint64_t{40} << 20, [] {
    try {
      const RenderPool pool(1000, [](const RenderedTile&) {});
    } catch (const std::system_error&) {
      std::thread([] {}).join();  // threads can start again
      return 7;
    }
    return 0;
  });
  EXPECT_EQ(result, 7);
}

}  // namespace
}  // namespace lightmill

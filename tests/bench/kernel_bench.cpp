// One method on one thread: CPU seconds, their share inside Embree, and a digest of the film's bits.
//
// Run two builds of it in turn to see what a kernel change gains, and whether it keeps the bits. A profiler sees
// nothing else in it.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/base/digest.h"
#include "tests/bench/embree_share.h"
#include "tests/bench/measure.h"
#include "tests/support/paths.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

struct Run {
  double seconds = 0;
  std::string bits;  ///< digest of all nodes' values
};

Result<Run> run(const TestScene& scene, const std::string& name, std::uint32_t level, std::uint64_t seed) {
  LM_ASSIGN_OR_RETURN(const auto method, make_method(scene.compiled(), {name, seed, 0}));
  const auto workspace = method->make_workspace();
  const TileGrid grid({0, 0, scene.compiled()->film_width(), scene.compiled()->film_height()});
  Run result;
  Xxh3Hasher hasher;
  const double start = thread_cpu_seconds();
  for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
    const Node node = method->render(grid.tile_rect({i}), {level, 0}, *workspace);
    hasher.append(std::as_bytes(std::span(node.values)));
  }
  result.seconds = thread_cpu_seconds() - start;
  result.bits = hasher.finish().hex();
  return result;
}

int fail(const Status& status) {
  fmt::print(stderr, "kernel_bench: {}\n", message_of(status));
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures one method on one thread.");
  std::vector<std::string> scenes{source_file("scenes/cornell-bench-blocks.json")};
  std::string method = "path";
  std::uint32_t level = 6;
  int size = 512, runs = 1;
  app.add_option("scenes", scenes, "scene documents")->capture_default_str();
  app.add_option("--method", method, "method with its parameters")->capture_default_str();
  app.add_option("--level", level, "log2 of the samples per pixel")->capture_default_str()->check(CLI::Range(1, 16));
  app.add_option("--size", size, "film width and height in pixels")->capture_default_str()->check(CLI::Range(8, 4096));
  app.add_option("--runs", runs, "runs of each scene")->capture_default_str()->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);

  for (const std::string& path : scenes) {
    if (const auto loaded = load_scene(std::vector{std::filesystem::path(path)}); !loaded.ok()) {
      return fail(loaded.status());
    }
    const TestScene scene = TestScene(path, read_image).resized(size, size);
    for (int i = 0; i < runs; ++i) {
      EmbreeShare share;
      share.start();
      const Result<Run> result = run(scene, method, level, 1);
      share.stop();
      if (!result.ok()) {
        return fail(result.status());
      }
      std::printf("%7.3f s  %5.1f %% inside Embree  %s  %s %s\n", result->seconds, share.percent(),
                  result->bits.c_str(), method.c_str(), path.substr(path.rfind('/') + 1).c_str());
      std::fflush(stdout);
    }
  }
}

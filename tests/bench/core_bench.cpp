// Measurements of the renderer on one thread: samples and rays per second, efficiency relative to the reference tracer,
// and the share of time in Embree.
//
// Efficiency is 1 / (relMSE × CPU seconds), against a reference by the renderer with another seed and many more
// samples. Its noise adds to both sides. With the defaults it is below a tenth. Runs of the two alternate, and the
// median ratio is reported, because the machine may be busy.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "tests/bench/embree_share.h"
#include "tests/bench/measure.h"
#include "tests/support/paths.h"
#include "tests/support/reference_tracer.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

struct Run {
  std::vector<double> image;
  double seconds = 0;
  RenderCounters counters;
};

Run run_core(const CompiledScene& scene, std::shared_ptr<const CompiledScene> shared, std::uint32_t level,
             std::uint64_t seed, const std::string& name) {
  const auto method = std::move(*make_method(std::move(shared), {name, seed, 0}));
  const auto workspace = method->make_workspace();
  const int width = scene.film_width(), height = scene.film_height();
  Run run;
  run.image.resize(static_cast<std::size_t>(width) * height * 3);
  const TileGrid grid({0, 0, width, height});
  for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
    const PixelRect tile = grid.tile_rect({i});
    const double start = thread_cpu_seconds();
    const Node node = method->render(tile, {level, 0}, *workspace);
    run.seconds += thread_cpu_seconds() - start;
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    for (std::size_t p = 0; p < pixels; ++p) {
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t x = tile.x + p % tile.width, y = tile.y + p / tile.width;
        run.image[(y * width + x) * 3 + c] =
            (static_cast<double>(node.values[c * pixels + p]) + node.values[(3 + c) * pixels + p]) /
            static_cast<double>(1u << level);
      }
    }
  }
  run.counters = workspace->counters;
  return run;
}

Run run_oracle(const ReferenceTracer& tracer, int width, int height, int samples, std::uint64_t seed) {
  Run run;
  const double start = thread_cpu_seconds();
  const auto image = tracer.render({0, 0, width, height}, samples, seed);
  run.seconds = thread_cpu_seconds() - start;
  run.image.assign(image.begin(), image.end());
  run.counters.samples = static_cast<std::uint64_t>(width) * height * samples;
  return run;
}

double rel_mse(const std::vector<double>& image, const std::vector<double>& reference) {
  double sum = 0;
  for (std::size_t i = 0; i < image.size(); ++i) {
    const double d = image[i] - reference[i];
    sum += d * d / (reference[i] * reference[i] + 0.01);
  }
  return sum / static_cast<double>(image.size());
}

void print(const char* who, const Run& run, double error) {
  const auto samples = static_cast<double>(run.counters.samples);
  std::printf("%-9s %6.2f s  %6.3f Msamples/s", who, run.seconds, samples / run.seconds * 1e-6);
  if (run.counters.closest_hit_rays > 0) {
    const auto rays = static_cast<double>(run.counters.closest_hit_rays + run.counters.shadow_rays);
    std::printf("  %6.2f Mrays/s (%.2f closest + %.2f shadow per sample)", rays / run.seconds * 1e-6,
                static_cast<double>(run.counters.closest_hit_rays) / samples,
                static_cast<double>(run.counters.shadow_rays) / samples);
  }
  std::printf("  relMSE %.3e  efficiency %.1f\n", error, 1 / (error * run.seconds));
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Compares the renderer with the scalar reference tracer, on one thread.");
  std::string scene_path = source_file("scenes/cornell-bench-blocks.json");
  std::string cache;
  std::string method = "path", reference_method = "path";
  std::uint32_t level = 6, reference_level = 11;
  int size = 512, pairs = 3;
  app.add_option("scene", scene_path, "scene document")->capture_default_str();
  app.add_option("--level", level, "log2 of the samples per pixel")->capture_default_str()->check(CLI::Range(1, 16));
  app.add_option("--reference-level", reference_level, "log2 of the reference's samples")
      ->capture_default_str()
      ->check(CLI::Range(1, 20));
  app.add_option("--size", size, "film width and height in pixels")->capture_default_str()->check(CLI::Range(8, 4096));
  app.add_option("--pairs", pairs, "runs of renderer and reference tracer in turn")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  app.add_option("--method", method, "method of the renderer; other methods are compared with path")
      ->capture_default_str();
  app.add_option("--reference-method", reference_method, "method that renders the reference")->capture_default_str();
  app.add_option("--cache", cache, "file that keeps the reference for the next run");
  CLI11_PARSE(app, argc, argv);

  const TestScene scene = TestScene(scene_path).resized(size, size);
  auto compiled = *CompiledScene::compile(scene.scene(), scene.assets());
  const ReferenceTracer tracer(scene.scene(), scene.assets());

  std::vector<double> reference(static_cast<std::size_t>(size) * size * 3);
  const auto bytes = static_cast<std::streamsize>(reference.size() * sizeof(double));
  std::ifstream cached(cache, std::ios::binary);
  if (cache.empty() || !cached.read(reinterpret_cast<char*>(reference.data()), bytes)) {
    std::printf("rendering the reference, %u samples per pixel …\n", 1u << reference_level);
    std::fflush(stdout);
    reference = run_core(*compiled, compiled, reference_level, 999'999, reference_method).image;
    if (!cache.empty()) {
      std::ofstream(cache, std::ios::binary).write(reinterpret_cast<const char*>(reference.data()), bytes);
    }
  }

  EmbreeShare share;
  std::vector<double> ratios;
  for (int pair = 0; pair < pairs; ++pair) {
    share.start();
    const Run core = run_core(*compiled, compiled, level, 1 + pair, method);
    share.stop();
    const Run oracle = method == "path" ? run_oracle(tracer, size, size, 1 << level, 1 + pair)
                                        : run_core(*compiled, compiled, level, 1 + pair, "path");
    const double core_error = rel_mse(core.image, reference), oracle_error = rel_mse(oracle.image, reference);
    print(method == "path" ? "renderer" : method.c_str(), core, core_error);
    print(method == "path" ? "reference" : "path", oracle, oracle_error);
    ratios.push_back(oracle_error * oracle.seconds / (core_error * core.seconds));
    std::printf("efficiency ratio %.2f\n", ratios.back());
  }
  std::printf("median efficiency ratio %.2f (%.2f to %.2f); %.0f %% of the renderer's time in Embree\n", median(ratios),
              *std::min_element(ratios.begin(), ratios.end()), *std::max_element(ratios.begin(), ratios.end()),
              share.percent());
}

// Effect of the constants of `path`: efficiency of other splits, roulettes and numbers of Sobol' pairs, relative to the
// current ones, on scenes of many kinds.
//
// Efficiency is 1 / (relMSE × CPU seconds), after 16, 64 and 256 samples of one run. The reference is the mean of all
// runs, which are unbiased and share no seed. relMSE leaves out the worst 0.1 % of pixels, because a few rare paths
// decide them. The variants run in turn, so a busy machine slows all of them.
#include <CLI/CLI.hpp>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <thread>

#include "common/methods/factories.h"
#include "tests/bench/measure.h"
#include "tests/support/paths.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

struct Variant {
  std::string name;
  tracer::Constants constants;
};

/// The first is the current variant. Each other one differs from it in one or two constants.
std::vector<Variant> all_variants() {
  std::vector<Variant> variants{{"in use", {}}};
  const auto add = [&](std::string name, const auto& change) {
    variants.push_back({std::move(name), {}});
    change(variants.back().constants);
  };
  using C = tracer::Constants;
  for (const std::uint32_t splits : {1, 4, 8}) {
    add(fmt::format("{} split paths", splits), [&](C& c) { c.splits = splits; });
  }
  for (const std::uint32_t below : {16, 64, 1024}) {
    add(fmt::format("split below {}", below), [&](C& c) { c.split_below = below; });
  }
  add("4 split paths below 64", [](C& c) {
    c.splits = 4;
    c.split_below = 64;
  });
  for (const float boost : {1.0f, 4.0f}) {
    add(fmt::format("early roulette {}", boost), [&](C& c) { c.early_roulette = boost; });
  }
  for (const float boost : {2.0f, 8.0f}) {
    add(fmt::format("late roulette {}", boost), [&](C& c) { c.late_roulette = boost; });
  }
  add("roulette from bounce 2", [](C& c) { c.first_roulette = 2; });
  for (const std::uint32_t vertices : {1, 2, 4, 6}) {
    add(fmt::format("Sobol' at {} vertices", vertices), [&](C& c) { c.sobol_vertices = vertices; });
  }
  return variants;
}

constexpr std::array<std::uint32_t, 3> kLevels{4, 6, 8};  ///< log2 of the samples at which a run is measured

/// State of a run at a level.
struct Stage {
  std::vector<double> image;
  double seconds = 0;
};
using Run = std::array<Stage, kLevels.size()>;

/// The dyadic ranges that extend samples [0, 2^from) to [0, 2^to).
std::vector<SampleRange> ranges_up_to(std::uint32_t to, std::optional<std::uint32_t> from) {
  if (!from) {
    return {{to, 0}};
  }
  std::vector<SampleRange> ranges;
  for (std::uint32_t level = *from; level < to; ++level) {
    ranges.push_back({level, 1});
  }
  return ranges;
}

Run run(const CompiledScene& scene, const Method& method) {
  const auto workspace = method.make_workspace();
  const int width = scene.film_width(), height = scene.film_height();
  const TileGrid grid({0, 0, width, height});
  std::vector<double> sums(static_cast<std::size_t>(width) * height * 3);
  double seconds = 0;
  Run result;
  for (std::size_t stage = 0; stage < kLevels.size(); ++stage) {
    const auto before = stage == 0 ? std::nullopt : std::optional(kLevels[stage - 1]);
    for (const SampleRange range : ranges_up_to(kLevels[stage], before)) {
      for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
        const PixelRect tile = grid.tile_rect({i});
        const double start = thread_cpu_seconds();
        const Node node = method.render(tile, range, *workspace);
        seconds += thread_cpu_seconds() - start;
        const auto pixels = static_cast<std::size_t>(tile.pixel_count());
        for (std::size_t p = 0; p < pixels; ++p) {
          const std::size_t x = tile.x + p % tile.width, y = tile.y + p / tile.width;
          for (std::size_t c = 0; c < 3; ++c) {
            sums[(y * width + x) * 3 + c] +=
                static_cast<double>(node.values[c * pixels + p]) + node.values[(3 + c) * pixels + p];
          }
        }
      }
    }
    result[stage].image = sums;
    for (double& value : result[stage].image) {
      value /= static_cast<double>(1u << kLevels[stage]);
    }
    result[stage].seconds = seconds;
  }
  return result;
}

/// relMSE without the worst 0.1 % of pixels.
double trimmed_rel_mse(const std::vector<double>& image, const std::vector<double>& reference) {
  std::vector<double> errors(image.size() / 3);
  for (std::size_t i = 0; i < image.size(); ++i) {
    const double d = image[i] - reference[i];
    errors[i / 3] += d * d / (reference[i] * reference[i] + 0.01);
  }
  std::sort(errors.begin(), errors.end());
  errors.resize(errors.size() - std::max<std::size_t>(1, errors.size() / 1000));
  double sum = 0;
  for (const double e : errors) {
    sum += e;
  }
  return sum / static_cast<double>(3 * errors.size());
}

/// Geometric mean, with its standard error as a factor minus 1.
struct GeometricMean {
  double value = 1, error = 0;
};
GeometricMean geometric_mean(const std::vector<double>& ratios) {
  double sum = 0, squares = 0;
  for (const double r : ratios) {
    sum += std::log(r);
    squares += std::log(r) * std::log(r);
  }
  const auto n = static_cast<double>(ratios.size());
  const double mean = sum / n;
  const double variance = n > 1 ? std::max(0.0, squares / n - mean * mean) / (n - 1) : 0;
  return {std::exp(mean), std::expm1(std::sqrt(variance))};
}

/// Efficiency of each variant over that of the first: one entry per stage, over all seeds of a scene.
using Gains = std::vector<std::array<GeometricMean, kLevels.size()>>;

Gains measure(const TestScene& scene, const std::vector<Variant>& variants, std::size_t seeds) {
  std::vector<std::vector<Run>> runs(variants.size());
  for (std::size_t seed = 0; seed < seeds; ++seed) {
    for (std::size_t v = 0; v < variants.size(); ++v) {
      const auto method =
          make_path_method(scene.compiled(), {"path", seed * variants.size() + v, 0}, variants[v].constants);
      runs[v].push_back(run(*scene.compiled(), *method));
    }
  }
  std::vector<double> reference(runs[0][0].back().image.size());
  for (const auto& of_variant : runs) {
    for (const Run& r : of_variant) {
      for (std::size_t i = 0; i < reference.size(); ++i) {
        reference[i] += r.back().image[i] / static_cast<double>(variants.size() * of_variant.size());
      }
    }
  }
  Gains gains(variants.size());
  for (std::size_t stage = 0; stage < kLevels.size(); ++stage) {
    for (std::size_t v = 0; v < variants.size(); ++v) {
      std::vector<double> ratios;
      for (std::size_t seed = 0; seed < seeds; ++seed) {
        const auto cost = [&](const Run& r) { return trimmed_rel_mse(r[stage].image, reference) * r[stage].seconds; };
        ratios.push_back(cost(runs[0][seed]) / cost(runs[v][seed]));
      }
      gains[v][stage] = geometric_mean(ratios);
    }
  }
  return gains;
}

void print(const std::string& title, const std::vector<Variant>& variants, const Gains& gains) {
  std::printf("\n%s\n%-24s", title.c_str(), "samples");
  for (const std::uint32_t level : kLevels) {
    std::printf("  %12u", 1u << level);
  }
  std::printf("\n");
  for (std::size_t v = 1; v < variants.size(); ++v) {
    std::printf("%-24s", variants[v].name.c_str());
    for (const GeometricMean& g : gains[v]) {
      std::printf("  %5.3f ±%5.3f", g.value, g.error);
    }
    std::printf("\n");
  }
  std::fflush(stdout);
}

/// Geometric mean and minimum over the scenes.
void print_summary(const std::vector<Variant>& variants, const std::vector<Gains>& scenes) {
  std::printf("\nall %zu scenes: geometric mean (minimum)\n%-24s", scenes.size(), "samples");
  for (const std::uint32_t level : kLevels) {
    std::printf("  %14u", 1u << level);
  }
  std::printf("\n");
  for (std::size_t v = 1; v < variants.size(); ++v) {
    std::printf("%-24s", variants[v].name.c_str());
    for (std::size_t stage = 0; stage < kLevels.size(); ++stage) {
      std::vector<double> values;
      for (const Gains& gains : scenes) {
        values.push_back(gains[v][stage].value);
      }
      std::printf("  %5.3f (%5.3f)", geometric_mean(values).value, *std::min_element(values.begin(), values.end()));
    }
    std::printf("\n");
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Efficiency of other constants of path, relative to the current ones.");
  std::vector<std::string> scenes{source_file("scenes/cornell-bench-blocks.json"),
                                  source_file("scenes/cornell-bench-balls.json"),
                                  source_file("tests/bench/constants/white-room.json"),
                                  source_file("scenes/metal-and-glass.json"),
                                  source_file("tests/bench/choices/rough-gold.json"),
                                  source_file("tests/bench/choices/sky-and-glass.json"),
                                  source_file("scenes/course-default.json"),
                                  source_file("scenes/bunny.json")};
  std::size_t seeds = 6;
  std::string only;
  int size = 40, threads = 1;
  app.add_option("scenes", scenes, "scene documents");
  app.add_option("--size", size, "film width and height in pixels")->capture_default_str()->check(CLI::Range(8, 512));
  app.add_option("--seeds", seeds, "runs of each variant")->capture_default_str()->check(CLI::Range(2, 100));
  app.add_option("--only", only, "only variants whose name has this text");
  app.add_option("--threads", threads, "scenes at a time")->capture_default_str()->check(CLI::Range(1, 64));
  CLI11_PARSE(app, argc, argv);

  std::vector<Variant> variants = all_variants();
  std::erase_if(variants, [&](const Variant& v) { return v.name != "in use" && v.name.find(only) == v.name.npos; });
  std::vector<Gains> all(scenes.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t i = next++; i < scenes.size(); i = next++) {
      all[i] = measure(TestScene(scenes[i], read_image).resized(size, size), variants, seeds);
    }
  };
  {
    std::vector<std::jthread> pool;
    for (int i = 0; i < threads; ++i) {
      pool.emplace_back(work);
    }
  }
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    print(scenes[i].substr(scenes[i].rfind('/') + 1), variants, all[i]);
  }
  print_summary(variants, all);
}

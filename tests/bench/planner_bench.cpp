// Foundations of the planner's pilot: the CPU time of the work that renderers count, and whether the pilot chooses the
// cheapest method.
//
// The first part fits the weights of common/planner/counted_cost.cpp to the CPU seconds of 32 samples per pixel on one
// thread, by scene, method and photons. The second part uses scenes in which `auto` has a choice. It compares relMSE ×
// CPU time by method with the pilot's estimate, and prints the cost of `auto` over the best method.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/counted_cost.h"
#include "common/planner/method_plan.h"
#include "common/planner/pilot.h"
#include "common/scene_io/load.h"
#include "tests/bench/measure.h"
#include "tests/support/paths.h"
#include "tests/support/read_image.h"

namespace {

using namespace lightmill;
namespace fs = std::filesystem;

template <typename T>
T value_or_exit(Result<T> result) {
  if (!result.ok()) {
    fmt::print(stderr, "planner_bench: {}\n", message_of(result.status()));
    std::exit(2);
  }
  return *std::move(result);
}

struct TestedScene {
  std::string name;
  SceneFacts facts;
  std::shared_ptr<const CompiledScene> compiled;
};

/// The scene with this many pixels on its longer side. Nothing if it cannot be read: models are downloaded separately.
std::optional<TestedScene> load(const fs::path& path, int side) {
  Result<LoadedScene> read = load_scene(std::span(&path, 1));
  if (!read.ok()) {
    fmt::print("left out: {}\n", message_of(read.status()));
    return std::nullopt;
  }
  LoadedScene loaded = *std::move(read);
  FilmSettings& film = loaded.scene.film;
  const int longer = std::max(film.width, film.height);
  film.width = std::max(1, film.width * side / longer);
  film.height = std::max(1, film.height * side / longer);
  const auto assets = [&](const Sha256& digest) -> Result<std::string> { return loaded.assets.at(digest); };
  const MeshSource meshes{[&](const Sha256& digest) -> std::optional<std::string> { return loaded.assets.at(digest); }};
  return TestedScene{path.stem().string(), read_facts(loaded.scene, meshes),
                     value_or_exit(CompiledScene::compile(loaded.scene, assets, read_image, {}))};
}

PixelRect film_of(const CompiledScene& scene) {
  return {0, 0, scene.film_width(), scene.film_height()};
}

/// Result and cost of a range of samples of the whole film.
struct Rendered {
  std::array<std::vector<double>, 2> sums;  ///< by half, RGB planes tile by tile
  double cpu_seconds = 0;
  RenderCounters counters;
};

Rendered render(const TestedScene& scene, const std::string& method_name, std::uint64_t seed, SampleRange range,
                std::uint32_t max_bounces = 0) {
  const auto method = value_or_exit(make_method(scene.compiled, {method_name, seed, max_bounces}));
  const auto workspace = method->make_workspace();
  const TileGrid grid(film_of(*scene.compiled));
  Rendered out;
  const double start = thread_cpu_seconds();
  for (std::uint32_t tile = 0; tile < grid.tile_count(); ++tile) {
    const Node node = method->render(grid.tile_rect({tile}), range, *workspace);
    const std::size_t half = node.values.size() / 2;
    for (const std::size_t h : {0, 1}) {
      out.sums[h].insert(out.sums[h].end(), node.values.begin() + static_cast<std::ptrdiff_t>(h * half),
                         node.values.begin() + static_cast<std::ptrdiff_t>((h + 1) * half));
    }
  }
  out.cpu_seconds = thread_cpu_seconds() - start;
  out.counters = workspace->counters;
  return out;
}

// ---- cost of the counted work ----

/// Shadow rays and closest hits have a fixed ratio (counted_cost.h). Both happen at the same vertices, so time alone
/// cannot separate them.
constexpr std::size_t kKinds = 7;
using Row = std::array<double, kKinds>;
constexpr std::array<const char*, kKinds> kKindNames{"pixel sample", "ray",          "gather",       "gathered",
                                                     "photon",       "photon's ray", "stored photon"};
Row row_of(const RenderCounters& c) {
  const auto number = [](std::uint64_t n) { return static_cast<double>(n); };
  return {number(c.samples),       number(c.closest_hit_rays) + kShadowRayCost * number(c.shadow_rays),
          number(c.gathers),       number(c.gathered),
          number(c.photons),       number(c.photon_rays),
          number(c.stored_photons)};
}

struct Measured {
  std::size_t scene = 0;
  std::string method;
  double seconds = 0;
  Row counts{};
};

double cost(const Row& counts, const Row& weights) {
  double sum = 0;
  for (std::size_t k = 0; k < kKinds; ++k) {
    sum += counts[k] * weights[k];
  }
  return sum;
}

/// Seconds of each kind of work: non-negative least squares of relative errors, by coordinate descent, which converges.
/// The factors of scenes are for the cost of a ray, and have geometric mean 1.
Row fit(std::span<const Measured> all, std::vector<double>& factors) {
  Row weights;
  weights.fill(1e-7);
  for (int round = 0; round < 20'000; ++round) {
    for (std::size_t k = 0; k < kKinds; ++k) {
      double top = 0, bottom = 0;
      for (const Measured& m : all) {
        const double x = m.counts[k] * factors[m.scene] / m.seconds;
        const double rest = 1 - cost(m.counts, weights) * factors[m.scene] / m.seconds + weights[k] * x;
        top += x * rest;
        bottom += x * x;
      }
      weights[k] = bottom > 0 ? std::max(top / bottom, 0.0) : 0;
    }
    std::vector<double> top(factors.size()), bottom(factors.size());
    for (const Measured& m : all) {
      const double x = cost(m.counts, weights) / m.seconds;
      top[m.scene] += x;
      bottom[m.scene] += x * x;
    }
    double logs = 0;
    for (std::size_t s = 0; s < factors.size(); ++s) {
      factors[s] = top[s] / bottom[s];
      logs += std::log(factors[s]) / static_cast<double>(factors.size());
    }
    for (double& factor : factors) {
      factor /= std::exp(logs);
    }
  }
  return weights;
}

void print_fit(const std::vector<TestedScene>& scenes, int repeats) {
  std::vector<Measured> all;
  for (std::size_t s = 0; s < scenes.size(); ++s) {
    std::vector<std::pair<std::string, std::uint32_t>> variants{{"path", 0}};
    if (!scenes[s].facts.casters.empty()) {
      variants.insert(variants.end(), {{"caustic", 0},
                                       {"caustic:photons=16384", 0},
                                       {"caustic:photons=16384", 2},  // fewer rays for the same number of photons
                                       {"caustic:photons=1024,radius=6", 0}});
    }
    for (const auto& [method, bounces] : variants) {
      Measured measured{s,
                        bounces == 0 ? method : fmt::format("{}, {} bounces", method, bounces),
                        std::numeric_limits<double>::infinity(),
                        {}};
      for (int i = 0; i < repeats; ++i) {
        const Rendered rendered = render(scenes[s], method, 1, {5, 2}, bounces);
        measured.seconds = std::min(measured.seconds, rendered.cpu_seconds);
        measured.counts = row_of(rendered.counters);
      }
      all.push_back(measured);
    }
  }
  std::vector<double> factors(scenes.size(), 1);
  const Row weights = fit(all, factors);
  fmt::print("{:34} {:33} {:>9} {:>7} {:>7}\n", "scene", "method", "seconds", "fitted", "factor");
  for (const Measured& m : all) {
    fmt::print("{:34} {:33} {:9.3f} {:7.3f} {:7.2f}\n", scenes[m.scene].name, m.method, m.seconds,
               cost(m.counts, weights) * factors[m.scene] / m.seconds, factors[m.scene]);
  }
  fmt::print("\n{:16} {:>8} {:>8}\n", "", "ns", "weight");
  for (std::size_t k = 0; k < kKinds; ++k) {
    fmt::print("{:16} {:8.1f} {:8.3f}\n", kKindNames[k], 1e9 * weights[k], weights[k] / weights[1]);
  }
}

// ---- choice of the pilot ----

/// relMSE of a picture against another one, complete and without the worst 0.1 %.
std::pair<double, double> errors_of(const Rendered& picture, double samples, std::span<const double> truth) {
  std::vector<double> squares(truth.size());
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double off = (picture.sums[0][i] + picture.sums[1][i]) / samples - truth[i];
    squares[i] = off * off / (truth[i] * truth[i] + 0.01);
    sum += squares[i];
  }
  return {sum / static_cast<double>(truth.size()), trimmed_mean(squares)};
}

/// CPU seconds of the best method to the error of a job. The table has the cost of a job over this, pilot included.
constexpr double kJobSeconds = 60;

void print_choices(const std::vector<TestedScene>& scenes, std::uint32_t level, std::uint32_t first, int seeds) {
  std::vector<double> regrets;
  for (const TestedScene& scene : scenes) {
    const MethodPlan plan = plan_method(scene.facts, kAutoMethod);
    if (plan.candidates.size() < 2) {
      continue;
    }
    const SampleRange range{level, first >> level}, longer{level + 3, 0};
    const std::string& best = plan.candidates.back();
    const Rendered reference = render(scene, best, 1000, longer);
    std::vector<double> truth(reference.sums[0].size());
    for (std::size_t i = 0; i < truth.size(); ++i) {
      truth[i] = (reference.sums[0][i] + reference.sums[1][i]) / static_cast<double>(longer.count());
    }
    fmt::print("\n{}\n", scene.name);
    std::vector<double> inefficiency;
    for (const std::string& method : plan.candidates) {
      double whole = 0, trimmed = 0, seconds = 0;
      for (int seed = 1; seed <= seeds; ++seed) {
        const Rendered rendered = render(scene, method, static_cast<std::uint64_t>(seed), range);
        const auto [all, most] = errors_of(rendered, static_cast<double>(range.count()), truth);
        whole += all / seeds;
        trimmed += most / seeds;
        seconds += rendered.cpu_seconds / seeds;
      }
      fmt::print("  {:10} {:8.3f} s, relMSE {:.3e}, trimmed {:.3e}; relMSE x seconds {:.3e}, trimmed {:.3e}\n", method,
                 seconds, whole, trimmed, whole * seconds, trimmed * seconds);
      inefficiency.push_back(whole * seconds);
    }
    const double least = std::ranges::min(inefficiency);
    for (int seed = 1; seed <= seeds; ++seed) {
      const double start = thread_cpu_seconds();
      const PilotChoice choice = value_or_exit(
          run_pilot(scene.compiled, {plan.candidates, static_cast<std::uint64_t>(seed), 0, film_of(*scene.compiled)}));
      const double pilot = thread_cpu_seconds() - start;
      const double regret = inefficiency[choice.choice] / least + pilot / kJobSeconds;
      regrets.push_back(regret);
      fmt::print("  pilot {}: {:.3f} s, {}: {}; regret {:.3f}\n", seed, pilot, plan.candidates[choice.choice],
                 fmt::join(choice.reasons, "; "), regret);
      std::fflush(stdout);
    }
  }
  if (!regrets.empty()) {
    double logs = 0;
    for (const double regret : regrets) {
      logs += std::log(regret) / static_cast<double>(regrets.size());
    }
    fmt::print("\nregret of {} pilots, for jobs of {} s: geometric mean {:.3f}, worst {:.3f}\n", regrets.size(),
               kJobSeconds, std::exp(logs), std::ranges::max(regrets));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures the cost of counted work, and the choices of pilots.");
  std::vector<std::string> files;
  int side = 128, repeats = 3, seeds = 4;
  std::uint32_t level = 7, first = 256;
  bool no_fit = false, no_choices = false;
  app.add_option("scenes", files, "scene documents (default: all of scenes/)");
  app.add_option("--side", side, "pixels of the longer side")->capture_default_str();
  app.add_option("--repeats", repeats, "repeats of each measurement of work; the fastest counts")
      ->capture_default_str();
  app.add_option("--level", level, "log2 of the samples per pixel of the compared pictures")
      ->capture_default_str()
      ->check(CLI::Range(6u, 12u));
  app.add_option(
         "--first", first,
         "first sample of the compared pictures, rounded down to a multiple of their count; samples below 256 are split")
      ->capture_default_str();
  app.add_option("--seeds", seeds, "seeds of the compared pictures and of pilots")->capture_default_str();
  app.add_flag("--no-fit", no_fit, "skip the cost of counted work");
  app.add_flag("--no-choices", no_choices, "skip the choices of pilots");
  CLI11_PARSE(app, argc, argv);
  std::vector<fs::path> paths(files.begin(), files.end());
  if (paths.empty()) {
    for (const auto& entry : fs::directory_iterator(test::source_file("scenes"))) {
      if (entry.path().extension() == ".json") {
        paths.push_back(entry.path());
      }
    }
    std::ranges::sort(paths);
  }
  std::vector<TestedScene> scenes;
  for (const fs::path& path : paths) {
    if (std::optional<TestedScene> scene = load(path, side)) {
      scenes.push_back(*std::move(scene));
    }
  }
  if (!no_fit) {
    print_fit(scenes, repeats);
  }
  if (!no_choices) {
    print_choices(scenes, level, first, seeds);
  }
  return 0;
}

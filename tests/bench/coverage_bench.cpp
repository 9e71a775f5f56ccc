// Check that jobs with an error goal reach their error: five scenes, each rendered many times with different seeds to a
// stated error, by the rule of common/film/error_goal.h. With --adaptive each run has a pilot for the samples of each
// tile.
//
// The true error is mean((x − r)² / (r² + 0.01)) of the picture x, minus the noise of the reference r, which its halves
// estimate. It must be within the stated error ± its half width in 93 % of all runs, and in 90 % in each scene.
#include <CLI/CLI.hpp>
#include <atomic>
#include <bit>
#include <cstdio>
#include <thread>

#include "common/film/error_goal.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/tile_noise.h"
#include "tests/support/paths.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

constexpr double kBright = 20;  ///< normal noise reaches this once in 100,000 values
constexpr double kPooledCoverage = 0.93, kMinCoverage = 0.9;

struct Case {
  const char* name;
  TestScene scene;
  double goal;   ///< the error goal
  int side = 0;  ///< pixels
  bool adaptive = false;
  std::string method = "path";

  /// The layers of a job. A method that gathers also renders what its bias is estimated from.
  std::vector<LayerSpec> layers() const {
    std::vector<std::string> names;
    if (method_gathers(parse_method(method).value().name)) {
      names.emplace_back(kBiasLayer);
    }
    return film_layers(names).value();
  }
  MethodSettings settings(std::uint64_t seed) const { return {method, seed, 0, layers()}; }
  Film empty_film(Allocation allocation = {}) const {
    return Film(TileGrid({0, 0, side, side}), NodeLayout(layers()), std::move(allocation));
  }
};

/// Metal and coated balls under a sky and a small light.
constexpr const char* kMetals = R"({
  "camera": {"eye": [0, 1.6, 4], "look_at": [0, 0.4, 0], "vertical_fov_degrees": 35},
  "materials": [
    {"name": "floor", "principled": {"base_color": {"rgb": [0.5, 0.35, 0.2]}, "roughness": 0.5}},
    {"name": "gold", "conductor": {"metal": "gold", "roughness": 0.3}},
    {"name": "coated", "principled": {"base_color": {"rgb": [0.1, 0.2, 0.6]}, "roughness": 0.6, "coat": 1, "coat_roughness": 0.2}},
    {"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [60, 50, 40]}}],
  "objects": [
    {"material": "floor", "plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
    {"material": "gold", "sphere": {"center": [-0.6, 0.5, 0], "radius": 0.5}},
    {"material": "coated", "sphere": {"center": [0.6, 0.5, 0.2], "radius": 0.5}},
    {"material": "lamp", "sphere": {"center": [1.5, 2.5, 1.5], "radius": 0.15}}],
  "lights": [{"environment": {"radiance": {"rgb": [0.3, 0.4, 0.5]}}}]})";

/// A closed grey room with a small light, and a glass ball beside the camera. Paths from wall to wall, through the ball
/// and to the light are rare and bright.
constexpr const char* kRare = R"({
  "camera": {"eye": [0, 1, 2.9], "look_at": [0, 0.9, 0], "vertical_fov_degrees": 55},
  "materials": [
    {"name": "wall", "diffuse": {"reflectance": {"rgb": [0.6, 0.6, 0.6]}}},
    {"name": "glass", "dielectric": {"ior": 1.5}},
    {"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [100, 100, 100]}}],
  "objects": [
    {"material": "wall", "plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
    {"material": "wall", "plane": {"point": [0, 2.5, 0], "normal": [0, -1, 0]}},
    {"material": "wall", "plane": {"point": [-1.5, 0, 0], "normal": [1, 0, 0]}},
    {"material": "wall", "plane": {"point": [1.5, 0, 0], "normal": [-1, 0, 0]}},
    {"material": "wall", "plane": {"point": [0, 0, -1.5], "normal": [0, 0, 1]}},
    {"material": "wall", "plane": {"point": [0, 0, 3], "normal": [0, 0, -1]}},
    {"material": "glass", "sphere": {"center": [1.1, 0.3, 2.4], "radius": 0.25}},
    {"material": "lamp", "sphere": {"center": [0.3, 2.2, 2], "radius": 0.1}}]})";

/// Renders each tile's part of the frame's samples [from, to). `from` is 0 or a multiple of to − from, so no part is
/// rounded.
void render(const Method& method, Workspace& workspace, Film& film, std::uint64_t from, std::uint64_t to) {
  for (std::uint32_t i = 0; i < film.grid().tile_count(); ++i) {
    const std::uint64_t first = film.allocation().of_tile(TileId{i}, from),
                        end = film.allocation().of_tile(TileId{i}, to);
    const auto level = static_cast<std::uint32_t>(std::countr_zero(end - first));
    const PixelRect rect = film.grid().tile_rect(TileId{i});
    const SampleRange range{level, static_cast<std::uint32_t>(first >> level)};
    film.merge(TileId{i}, std::make_shared<const Node>(method.render(rect, range, workspace)));
  }
}

/// Mean and variance of each pixel and channel, tile by tile.
struct Picture {
  std::vector<double> mean, variance;
};
Picture picture_of(const Film& film) {
  Picture picture;
  for (std::uint32_t i = 0; i < film.grid().tile_count(); ++i) {
    const std::vector<float> sums = film.beauty_sums(TileId{i});
    const double half = static_cast<double>(film.samples(TileId{i})) / 2;
    for (std::size_t k = 0; k < sums.size() / 2; ++k) {
      const double a = sums[k] / half, b = sums[sums.size() / 2 + k] / half;
      picture.mean.push_back((a + b) / 2);
      picture.variance.push_back((a - b) * (a - b) / 4);
    }
  }
  return picture;
}

struct Run {
  std::uint64_t samples = 0;
  FrameError stated;
  double truth = 0;
  std::size_t bright = 0;  ///< pixels whose error is more than kBright times the mean pixel's
};

Run run(const Case& each, const std::shared_ptr<const CompiledScene>& compiled, const Picture& reference,
        std::uint64_t seed) {
  const auto method = make_method(compiled, each.settings(seed)).value();
  const auto workspace = method->make_workspace();
  Film film = each.empty_film();
  if (each.adaptive) {
    film = each.empty_film(find_allocation(compiled, {each.method, seed, 0, film.grid()}).value().allocation);
  }
  ErrorEstimator estimator;
  Run run;
  do {
    const std::uint64_t next = next_error_count(run.samples + 1, first_error_count(film.allocation()));
    render(*method, *workspace, film, run.samples, next);
    run.samples = next;
    run.stated = estimator.update_all(film);
  } while (!meets(run.stated, each.goal));

  const Picture picture = picture_of(film);
  std::vector<double> terms;
  double noise = 0;
  for (std::size_t k = 0; k < picture.mean.size(); ++k) {
    const double distance = picture.mean[k] - reference.mean[k];
    const double scale = reference.mean[k] * reference.mean[k] + 0.01;
    terms.push_back(distance * distance / scale);
    noise += reference.variance[k] / scale;
  }
  const auto count = static_cast<double>(terms.size());
  const double mean = std::accumulate(terms.begin(), terms.end(), 0.0) / count;
  run.truth = mean - noise / count;
  run.bright =
      static_cast<std::size_t>(std::ranges::count_if(terms, [&](double term) { return term > kBright * mean; })) /
      kBeautyChannels;
  return run;
}

template <class T>
T median(std::vector<T> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Calls `work` with 0 … count − 1 on several threads.
void in_parallel(int threads, int count, const std::function<void(int)>& work) {
  std::atomic<int> next = 0;
  std::vector<std::jthread> pool;
  for (int i = 0; i < threads; ++i) {
    pool.emplace_back([&] {
      for (int k = next++; k < count; k = next++) {
        work(k);
      }
    });
  }
}

Picture render_reference(const Case& each, const std::shared_ptr<const CompiledScene>& compiled, std::uint64_t samples,
                         int threads) {
  constexpr std::uint64_t kPart = 256;
  Film film = each.empty_film();
  std::mutex mutex;
  in_parallel(threads, static_cast<int>(samples / kPart), [&](int part) {
    const auto method = make_method(compiled, each.settings(1'000'003)).value();
    const auto workspace = method->make_workspace();
    Film own = each.empty_film();
    const std::uint64_t first = kPart * static_cast<std::uint64_t>(part);
    render(*method, *workspace, own, first, first + kPart);
    const std::lock_guard lock(mutex);
    for (std::uint32_t i = 0; i < film.grid().tile_count(); ++i) {
      film.merge(TileId{i}, own.forest(TileId{i}).front());
    }
  });
  return picture_of(film);
}

struct Tally {
  int runs = 0, held = 0, below_goal = 0;
};

Tally report(const Case& each, const std::vector<Run>& runs, double reference_error) {
  Tally tally;
  std::vector<std::uint64_t> counts;
  std::vector<std::size_t> bright;
  double stated = 0, truth = 0, width = 0;
  int above = 0, below = 0;
  for (const Run& run : runs) {
    ++tally.runs;
    above += run.truth > run.stated.rel_mse + run.stated.half_width ? 1 : 0;
    below += run.truth < run.stated.rel_mse - run.stated.half_width ? 1 : 0;
    tally.below_goal += run.truth <= each.goal ? 1 : 0;
    counts.push_back(run.samples);
    bright.push_back(run.bright);
    stated += run.stated.rel_mse;
    truth += run.truth;
    width += run.stated.half_width;
  }
  tally.held = tally.runs - above - below;
  const auto percent = [&](int n) { return 100.0 * n / tally.runs; };
  std::printf("%-22s %7.4g  %6llu (%llu-%llu)  %6.1f %%  %5.1f %%  %5.1f %%  %6.1f %%  %6.3f  %5.3f  %6zu  %8.2g\n",
              each.name, each.goal, static_cast<unsigned long long>(median(counts)),
              static_cast<unsigned long long>(*std::ranges::min_element(counts)),
              static_cast<unsigned long long>(*std::ranges::max_element(counts)), percent(tally.held), percent(above),
              percent(below), percent(tally.below_goal), stated / truth, width / stated, median(bright),
              reference_error);
  std::fflush(stdout);
  return tally;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Runs jobs with an error goal, and counts how often the true error is in the stated interval.");
  int seeds = 200, threads = 2, side = 96;
  bool adaptive = false;
  std::string method = "path";
  std::uint64_t reference_samples = 1024;
  double scale = 1;
  std::vector<std::string> only;
  app.add_option("--seeds", seeds, "runs of each scene")->capture_default_str()->check(CLI::Range(1, 100'000));
  app.add_option("--threads", threads, "render threads")->capture_default_str()->check(CLI::Range(1, 256));
  app.add_option("--reference", reference_samples, "samples per pixel of the reference, a power of two")
      ->capture_default_str()
      ->check(CLI::Range(512, 1 << 24));
  app.add_option("--scale", scale, "factor of the error goals")->capture_default_str();
  app.add_option("--only", only, "scenes by name");
  app.add_option("--method", method,
                 "method of the runs and the reference; with photons the reference has less blur with more samples")
      ->capture_default_str();
  app.add_option("--side", side, "width and height of the pictures in pixels")
      ->capture_default_str()
      ->check(CLI::Range(2, 4096));
  app.add_flag("--adaptive", adaptive, "use a pilot, which gives some tiles more samples");
  CLI11_PARSE(app, argc, argv);

  const std::filesystem::path folder = source_file("scenes");
  std::vector<Case> cases;
  cases.push_back({"cornell-bench-blocks", TestScene(folder / "cornell-bench-blocks.json"), 0.003});
  cases.push_back({"cornell-bench-balls", TestScene(folder / "cornell-bench-balls.json"), 0.03});
  cases.push_back({"cornell-course-balls", TestScene(folder / "cornell-course-balls.json"), 0.03});
  cases.push_back({"metals", TestScene::from_text(kMetals), 0.002});
  cases.push_back({"rare bright samples", TestScene::from_text(kRare), 0.015});

  std::printf(
      "scene                      goal  samples per pixel      held  above   below  <= goal  stated/true  width  "
      "bright  reference\n");
  Tally all;
  bool each_holds = true;
  for (const Case& each : cases) {
    if (!only.empty() && std::ranges::find(only, each.name) == only.end()) {
      continue;
    }
    Case scaled{each.name, each.scene.resized(side, side), each.goal * scale, side, adaptive, method};
    const auto compiled = CompiledScene::compile(scaled.scene.scene(), scaled.scene.assets()).value();
    const Picture reference = render_reference(scaled, compiled, std::bit_floor(reference_samples), threads);
    double reference_error = 0;
    for (std::size_t k = 0; k < reference.mean.size(); ++k) {
      reference_error += reference.variance[k] / (reference.mean[k] * reference.mean[k] + 0.01);
    }
    reference_error /= static_cast<double>(reference.mean.size());
    std::vector<Run> runs(static_cast<std::size_t>(seeds));
    in_parallel(threads, seeds, [&](int i) {
      runs[static_cast<std::size_t>(i)] = run(scaled, compiled, reference, 1 + static_cast<std::uint64_t>(i));
    });
    const Tally tally = report(scaled, runs, reference_error);
    all.runs += tally.runs;
    all.held += tally.held;
    all.below_goal += tally.below_goal;
    each_holds = each_holds && tally.held >= kMinCoverage * tally.runs;
  }
  const bool holds = each_holds && all.held >= kPooledCoverage * all.runs;
  std::printf("all %d runs: %.1f %% in the stated interval, %.1f %% at or below the goal: %s\n", all.runs,
              100.0 * all.held / all.runs, 100.0 * all.below_goal / all.runs, holds ? "enough" : "TOO FEW");
  return holds ? 0 : 1;
}

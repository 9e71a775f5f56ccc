// Fall of a method's error with the number of samples. Renders 16×16 pixels of scenes with exact answers, from 2^10 to
// 2^20 samples per pixel. Fits the slope of relMSE against samples on logarithmic scales. Noise that averages out falls
// with slope −1, and evenly distributed points fall faster. A bias, lost bits in a sum or a repeated sequence shows as
// a slope above −1 at the right end.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <thread>

#include "common/film/film.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

constexpr int kSide = 16;
constexpr std::uint32_t kFirstLevel = 10;
constexpr double kFlattest = -0.95;

struct Case {
  const char* name;
  TestScene scene;
  double exact;  ///< radiance of every pixel
};

/// The view from inside a diffuse sphere of radius 1.
std::string inside_a_sphere(double reflectance, const std::string& materials, const std::string& things) {
  return fmt::format(R"({{
    "camera": {{"eye": [0.6, 0, 0], "look_at": [1, 0, 0], "up": [0, 0, 1], "vertical_fov_degrees": 60}},
    "film": {{"width": {0}, "height": {0}}},
    "materials": [{{"name": "wall", "diffuse": {{"reflectance": {{"rgb": [{1}, {1}, {1}]}}}}}}{2}],
    "objects": [{{"material": "wall", "sphere": {{"center": [0, 0, 0], "radius": 1, "normal_inward": true}}}}{3})",
                     kSide, reflectance, materials, things);
}

std::vector<Case> cases() {
  // The share f = (r/R)² of the wall's light meets the emitter: L = ρ f / (1 − ρ (1 − f)).
  constexpr double kReflectance = 0.5, kShare = 0.25 * 0.25;
  std::vector<Case> all;
  all.push_back(
      {"a black emitter of radius 0.25 in a diffuse sphere",
       TestScene::from_text(inside_a_sphere(
           kReflectance,
           R"(, {"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [1, 1, 1]}})",
           R"(, {"material": "lamp", "sphere": {"center": [0, 0, 0], "radius": 0.25}}]})")),
       kReflectance * kShare / (1 - kReflectance * (1 - kShare))});
  // Every bounce reflects ρ of I/R²: L = I/(π R²) · ρ/(1 − ρ). A glass ball would be a better test, but has no closed
  // form.
  all.push_back(
      {"a point light in the middle of a diffuse sphere, albedo 0.8",
       TestScene::from_text(inside_a_sphere(
           0.8, "", R"(], "lights": [{"point": {"position": [0, 0, 0], "intensity": {"rgb": [2, 2, 2]}}}]})")),
       2 / M_PI * 4});
  return all;
}

/// relMSE of one run at 2^kFirstLevel, … 2^last samples.
std::vector<double> errors_of_run(const Case& each, const std::string& method_name, std::uint64_t seed,
                                  std::uint32_t last) {
  const auto compiled = CompiledScene::compile(each.scene.scene(), each.scene.assets()).value();
  const auto method = make_method(compiled, {method_name, seed, 0}).value();
  const auto workspace = method->make_workspace();
  Film film(TileGrid({0, 0, kSide, kSide}), kBeautyChannels);
  const PixelRect rect = film.grid().tile_rect(TileId{0});
  const auto extend = [&](SampleRange range) {
    film.merge(TileId{0}, std::make_shared<const Node>(method->render(rect, range, *workspace)));
  };
  std::vector<double> errors;
  extend({kFirstLevel, 0});
  for (std::uint32_t level = kFirstLevel;; ++level) {
    const std::vector<float> sums = film.beauty_sums(TileId{0});
    const auto count = static_cast<double>(film.samples(TileId{0}));
    double total = 0;
    for (std::size_t k = 0; k < sums.size() / 2; ++k) {
      const double distance = (static_cast<double>(sums[k]) + sums[sums.size() / 2 + k]) / count - each.exact;
      total += distance * distance / (each.exact * each.exact + 0.01);
    }
    errors.push_back(total / (static_cast<double>(sums.size()) / 2));
    if (level == last) {
      return errors;
    }
    extend({level, 1});
  }
}

/// Slope of the least squares line through (k, log2 y_k).
double slope_of(const std::vector<double>& y) {
  const auto n = static_cast<double>(y.size());
  double sum_x = 0, sum_y = 0, sum_xx = 0, sum_xy = 0;
  for (std::size_t k = 0; k < y.size(); ++k) {
    const auto x = static_cast<double>(k);
    const double value = std::log2(y[k]);
    sum_x += x;
    sum_y += value;
    sum_xx += x * x;
    sum_xy += x * value;
  }
  return (n * sum_xy - sum_x * sum_y) / (n * sum_xx - sum_x * sum_x);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Measures the slope of relMSE against samples, on scenes with exact answers.");
  std::vector<std::string> methods{"path"};
  int seeds = 4;
  std::uint32_t last = 20;
  app.add_option("--methods", methods, "to measure")->capture_default_str();
  app.add_option("--seeds", seeds, "runs of each scene, in parallel")->capture_default_str()->check(CLI::Range(1, 64));
  app.add_option("--last", last, "log2 of the maximum samples per pixel")
      ->capture_default_str()
      ->check(CLI::Range(12, 24));
  CLI11_PARSE(app, argc, argv);

  bool all_hold = true;
  for (const std::string& method : methods) {
    for (const Case& each : cases()) {
      std::vector<std::vector<double>> runs(static_cast<std::size_t>(seeds));
      {
        std::vector<std::jthread> threads;
        for (std::size_t i = 0; i < runs.size(); ++i) {
          threads.emplace_back([&, i] { runs[i] = errors_of_run(each, method, 1 + i, last); });
        }
      }
      std::printf("%s: %s\n  log2 samples  relMSE, mean of %d seeds\n", method.c_str(), each.name, seeds);
      std::vector<double> mean(runs.front().size());
      for (std::size_t k = 0; k < mean.size(); ++k) {
        for (const auto& run : runs) {
          mean[k] += run[k] / seeds;
        }
        std::printf("  %12zu  %.3e\n", kFirstLevel + k, mean[k]);
      }
      const double slope = slope_of(mean);
      const bool holds = slope <= kFlattest;
      all_hold = all_hold && holds;
      std::printf("  slope %.3f: %s\n", slope, holds ? "steep enough" : "TOO FLAT");
      std::fflush(stdout);
    }
  }
  return all_hold ? 0 : 1;
}

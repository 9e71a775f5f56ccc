// Noise of a method: relMSE against a reference, and CPU seconds, for several seeds.
//
//   noise_bench SCENE --level 12 --write reference.bin    writes a reference of 2^12 samples per pixel
//   noise_bench SCENE --level 6 --reference reference.bin measures runs of 2^6 samples
//
// A reference from another version of the program shows what a change does to noise and bias.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <fstream>

#include "tests/bench/measure.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

/// The mean picture of seeds [first, first + seeds).
std::vector<double> mean_picture(const TestScene& scene, MethodSettings settings, std::uint32_t level,
                                 std::uint64_t first, std::uint64_t seeds) {
  std::vector<double> sum;
  for (std::uint64_t i = 0; i < seeds; ++i) {
    settings.seed = first + i;
    const HalfImages image = scene.render(settings, level);
    sum.resize(image.a.size());
    for (std::size_t k = 0; k < sum.size(); ++k) {
      sum[k] += image.mean(k) / static_cast<double>(seeds);
    }
  }
  return sum;
}

/// relMSE per pixel, ascending.
std::vector<double> sorted_errors(const std::vector<double>& picture, const std::vector<double>& reference) {
  std::vector<double> errors(picture.size() / 3);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const double d = picture[i] - reference[i];
    errors[i / 3] += d * d / (reference[i] * reference[i] + 0.01) / 3;
  }
  std::sort(errors.begin(), errors.end());
  return errors;
}

double mean(const std::vector<double>& values, std::size_t count) {
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    sum += values[i];
  }
  return sum / static_cast<double>(count);
}

struct Spread {
  double mean = 0, error = 0;
};
Spread spread(const std::vector<double>& values) {
  const double m = mean(values, values.size());
  double squares = 0;
  for (const double v : values) {
    squares += (v - m) * (v - m);
  }
  const auto n = static_cast<double>(values.size());
  return {m, std::sqrt(squares / std::max(n - 1, 1.0) / n)};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Noise of a method against a reference: relMSE and CPU seconds.");
  std::string scene_path, write, reference_path, method = "path";
  std::uint32_t level = 6;
  std::uint64_t seeds = 6, first = 1;
  int size = 96;
  double trim = 0.001;
  app.add_option("scene", scene_path, "scene document")->required();
  app.add_option("--level", level, "log2 of the samples per pixel")->capture_default_str()->check(CLI::Range(1, 24));
  app.add_option("--seeds", seeds, "runs")->capture_default_str()->check(CLI::Range(1, 1000));
  app.add_option("--first", first, "the first seed")->capture_default_str();
  app.add_option("--size", size, "film height in pixels")->capture_default_str()->check(CLI::Range(8, 512));
  app.add_option("--trim", trim, "share of pixels, the worst ones, that the second relMSE leaves out")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 0.9));
  app.add_option("--method", method, "method")->capture_default_str();
  app.add_option("--write", write, "write the mean of all runs to this file");
  app.add_option("--reference", reference_path, "file of a reference");
  CLI11_PARSE(app, argc, argv);

  const TestScene original(scene_path, read_image);
  const auto& film = original.scene().film;
  const TestScene scene = original.resized(size * film.width / film.height, size);
  const MethodSettings settings{method, 0, 0};
  if (!write.empty()) {
    const std::vector<double> picture = mean_picture(scene, settings, level, first, seeds);
    std::ofstream(write, std::ios::binary)
        .write(reinterpret_cast<const char*>(picture.data()),
               static_cast<std::streamsize>(picture.size() * sizeof(double)));
    return 0;
  }
  std::ifstream file(reference_path, std::ios::binary);
  std::vector<double> reference(3 * static_cast<std::size_t>(size * (size * film.width / film.height)));
  if (!file.read(reinterpret_cast<char*>(reference.data()),
                 static_cast<std::streamsize>(reference.size() * sizeof(double)))) {
    std::fprintf(stderr, "cannot read %s\n", reference_path.c_str());
    return 2;
  }
  std::vector<double> all, trimmed, seconds, ratios;
  double reference_mean = mean(reference, reference.size());
  for (std::uint64_t i = 0; i < seeds; ++i) {
    const double start = thread_cpu_seconds();
    const std::vector<double> picture = mean_picture(scene, settings, level, first + i, 1);
    seconds.push_back(thread_cpu_seconds() - start);
    const std::vector<double> errors = sorted_errors(picture, reference);
    all.push_back(mean(errors, errors.size()));
    const auto worst = static_cast<std::size_t>(std::ceil(trim * static_cast<double>(errors.size())));
    trimmed.push_back(mean(errors, errors.size() - worst));
    ratios.push_back(mean(picture, picture.size()) / reference_mean);
  }
  const Spread relmse = spread(all), without_worst = spread(trimmed), ratio = spread(ratios);
  std::printf("relMSE %.3e ±%.1e, without the worst %g %% %.3e ±%.1e, CPU %.3f s, energy %.5f ±%.5f\n", relmse.mean,
              relmse.error, 100 * trim, without_worst.mean, without_worst.error, median(seconds), ratio.mean,
              ratio.error);
}

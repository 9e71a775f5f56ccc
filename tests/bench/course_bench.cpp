// Two tables of a university rendering course on one thread, as Markdown. The first has the time with and without a
// BVH. The second has time and error for subdivisions of the pixel, compared with plain random sampling.
//
// Plain random sampling is the same kernel with a separate seed for every sample. Sample i of a picture is sample i of
// sequence i, so the samples are independent. The error is relMSE against many samples of another seed.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <numeric>

#include "common/base/check.h"
#include "common/methods/method.h"
#include "common/scene/mesh.h"
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
    std::fprintf(stderr, "course_bench: %s\n", message_of(result.status()).c_str());
    std::exit(2);
  }
  return *std::move(result);
}

std::shared_ptr<const CompiledScene> compile(const LoadedScene& loaded, bool brute_force = false) {
  const auto assets = [&](const Sha256& digest) -> Result<std::string> { return loaded.assets.at(digest); };
  return value_or_exit(CompiledScene::compile(loaded.scene, assets, read_image, {brute_force}));
}

LoadedScene load(const std::string& name) {
  const fs::path path = test::source_file("scenes/" + name + ".json");
  return value_or_exit(load_scene(std::span(&path, 1)));
}

std::size_t triangle_count(const LoadedScene& loaded) {
  std::size_t count = 0;
  for (const Object& object : loaded.scene.objects) {
    if (const auto* mesh = std::get_if<MeshShape>(&object.shape)) {
      count += value_or_exit(decode_mesh(as_byte_view(loaded.assets.at(mesh->asset)))).triangles.size();
    }
  }
  return count;
}

std::unique_ptr<Method> method_of(std::shared_ptr<const CompiledScene> scene, const MethodSettings& settings) {
  return value_or_exit(make_method(std::move(scene), settings));
}

/// Sums over samples, RGB interleaved, row by row, and their cost.
struct Picture {
  explicit Picture(const CompiledScene& scene)
      : width(scene.film_width()), height(scene.film_height()), sums(static_cast<std::size_t>(width) * height * 3) {}
  int width, height;
  std::vector<double> sums;
  std::uint64_t samples = 0;  ///< per pixel
  double cpu_seconds = 0;
};

/// Adds one range of samples of every pixel.
void render(const Method& method, SampleRange range, Picture& picture) {
  const auto workspace = method.make_workspace();
  const TileGrid grid({0, 0, picture.width, picture.height});
  for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
    const PixelRect tile = grid.tile_rect({i});
    const double start = thread_cpu_seconds();
    const Node node = method.render(tile, range, *workspace);
    picture.cpu_seconds += thread_cpu_seconds() - start;
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    for (std::size_t p = 0; p < pixels; ++p) {
      const std::size_t pixel = (tile.y + p / tile.width) * picture.width + tile.x + p % tile.width;
      for (std::size_t c = 0; c < 3; ++c) {
        picture.sums[pixel * 3 + c] +=
            static_cast<double>(node.values[c * pixels + p]) + node.values[(3 + c) * pixels + p];
      }
    }
  }
  picture.samples += std::uint64_t{1} << range.level;
}

/// relMSE against a reference; trimmed: without the worst 0.1 % of the pixels.
struct RelMse {
  double all = 0, trimmed = 0;
};

RelMse rel_mse(const Picture& picture, const Picture& reference) {
  std::vector<double> errors(picture.sums.size() / 3);
  for (std::size_t i = 0; i < picture.sums.size(); ++i) {
    const double r = reference.sums[i] / static_cast<double>(reference.samples);
    const double d = picture.sums[i] / static_cast<double>(picture.samples) - r;
    errors[i / 3] += d * d / (r * r + 0.01) / 3;
  }
  std::sort(errors.begin(), errors.end());
  const auto mean = [&](std::size_t count) {
    return std::accumulate(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(count), 0.0) /
           static_cast<double>(count);
  };
  return {mean(errors.size()), mean(errors.size() - errors.size() / 1000)};
}

/// Difference of two pictures with the same hits: the largest relative error (below 0.1, times ten), and the pixels
/// with an error above 0.01.
struct Difference {
  double largest = 0;
  std::size_t pixels = 0;
};

Difference difference_of(const Picture& a, const Picture& b) {
  Difference difference;
  for (std::size_t p = 0; p < a.sums.size(); p += 3) {
    double error = 0;
    for (std::size_t i = p; i < p + 3; ++i) {
      error = std::max(error, std::abs(a.sums[i] - b.sums[i]) / std::max(std::abs(b.sums[i]), 0.1));
    }
    difference.largest = std::max(difference.largest, error);
    difference.pixels += error > 0.01 ? 1 : 0;
  }
  return difference;
}

/// "1.23 (1.20–1.31)": the median and the range.
std::string spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return fmt::format("{:.3g} ({:.3g}–{:.3g})", median(values), *low, *high);
}

/// One sample per pixel, with and without the BVH.
void tree_table(const std::vector<std::string>& names, const MethodSettings& settings, int runs) {
  std::printf(
      "| scene | triangles | film | BVH, s | brute force, s | gain | pixels that differ by 0.01 | "
      "largest difference |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const std::string& name : names) {
    const LoadedScene loaded = load(name);
    std::vector<double> seconds[2];
    std::vector<Picture> pictures;
    for (const bool brute_force : {false, true}) {
      const auto scene = compile(loaded, brute_force);
      const auto method = method_of(scene, settings);
      for (int run = 0; run < (brute_force ? std::min(runs, 3) : runs); ++run) {
        Picture picture(*scene);
        render(*method, {0, 0}, picture);
        seconds[brute_force ? 1 : 0].push_back(picture.cpu_seconds);
        if (run == 0) {
          pictures.push_back(std::move(picture));
        }
      }
    }
    const Difference difference = difference_of(pictures[0], pictures[1]);
    std::printf("| `%s` | %zu | %d×%d | %s | %s | %.3g | %zu | %.1e |\n", name.c_str(), triangle_count(loaded),
                pictures[0].width, pictures[0].height, spread(seconds[0]).c_str(), spread(seconds[1]).c_str(),
                median(seconds[1]) / median(seconds[0]), difference.pixels, difference.largest);
    std::fflush(stdout);
  }
}

/// n×n samples per pixel: time and error of the renderer's sequences, and of independent samples.
void subdivision_table(const std::string& name, MethodSettings settings, int size, std::uint32_t reference_level,
                       int runs) {
  LoadedScene loaded = load(name);
  loaded.scene.film.width = size;
  loaded.scene.film.height = size;
  const auto scene = compile(loaded);
  settings.seed = 999'999;
  Picture reference(*scene);
  render(*method_of(scene, settings), {reference_level, 0}, reference);

  std::printf("| subdivisions | samples | CPU s | relMSE | relMSE, plain random | random / Sobol' | trimmed |\n");
  std::printf("| --- | --- | --- | --- | --- | --- | --- |\n");
  for (std::uint32_t level = 0; level <= 8; level += 2) {
    std::vector<double> seconds, errors, trimmed, random_errors, random_trimmed;
    for (int run = 0; run < runs; ++run) {
      settings.seed = static_cast<std::uint64_t>(run) + 1;
      Picture picture(*scene);
      render(*method_of(scene, settings), {level, 0}, picture);
      seconds.push_back(picture.cpu_seconds);
      const RelMse error = rel_mse(picture, reference);
      errors.push_back(error.all);
      trimmed.push_back(error.trimmed);

      Picture random(*scene);
      for (std::uint32_t i = 0; i < (1u << level); ++i) {
        settings.seed = 1'000'000 + (static_cast<std::uint64_t>(run) << 16) + i;
        render(*method_of(scene, settings), {0, i}, random);
      }
      const RelMse random_error = rel_mse(random, reference);
      random_errors.push_back(random_error.all);
      random_trimmed.push_back(random_error.trimmed);
    }
    std::printf("| %u×%u | %u | %s | %s | %s | %.2f | %.2f |\n", 1u << level / 2, 1u << level / 2, 1u << level,
                spread(seconds).c_str(), spread(errors).c_str(), spread(random_errors).c_str(),
                median(random_errors) / median(errors), median(random_trimmed) / median(trimmed));
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Prints two tables: the gain of a BVH, and subdivisions against time and error.");
  std::string part = "all", tree_method = "raycast", method = "path";
  std::vector<std::string> tree_scenes = {"cornell-course-blocks", "teapot", "bunny"};
  std::vector<std::string> scenes = {"cornell-course-blocks", "course-default"};
  int size = 128, runs = 8;
  std::uint32_t reference_level = 13;
  app.add_option("part", part, "tree, subdivisions or all")
      ->capture_default_str()
      ->check(CLI::IsMember({"tree", "subdivisions", "all"}));
  app.add_option("--tree-method", tree_method, "method of the first table")->capture_default_str();
  app.add_option("--tree-scenes", tree_scenes, "its scenes")->capture_default_str();
  app.add_option("--method", method, "method of the second table")->capture_default_str();
  app.add_option("--scenes", scenes, "its scenes")->capture_default_str();
  app.add_option("--size", size, "film width and height in pixels for the second table")
      ->capture_default_str()
      ->check(CLI::Range(8, 4096));
  app.add_option("--reference-level", reference_level, "log2 of the reference's samples for the second table")
      ->capture_default_str()
      ->check(CLI::Range(1, 20));
  app.add_option("--runs", runs, "measurements; at most three by brute force")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);

  if (part != "subdivisions") {
    tree_table(tree_scenes, {tree_method, 1, 0}, runs);
  }
  if (part != "tree") {
    for (const std::string& name : scenes) {
      std::printf("\n`%s`, %d×%d, `%s`:\n\n", name.c_str(), size, size, method.c_str());
      subdivision_table(name, {method, 1, 0}, size, reference_level, runs);
    }
  }
}

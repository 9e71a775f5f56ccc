// Error of reconstructed pictures, compared with raw ones of equal samples, and the time of the reconstruction. Renders
// scenes with several numbers of samples and compares the raw and the reconstructed picture with a reference.
//
// relMSE = mean((x − a)(x − b) / (r² + 0.01)), with the halves a and b of the reference and their mean r. So the
// reference's noise is not part of it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "common/film/film.h"
#include "common/film/reconstruct.h"
#include "common/image/color.h"
#include "common/image/png.h"
#include "tests/bench/measure.h"
#include "tests/support/paths.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"

namespace {

using namespace lightmill;
using namespace lightmill::test;

/// A closed room of coloured walls with a rough metal and a coated ball, seen through a lens.
constexpr const char* kGlossy = R"({
  "camera": {"eye": [0, 1, 2.9], "look_at": [0, 0.9, 0], "vertical_fov_degrees": 55},
  "materials": [
    {"name": "wall", "principled": {"base_color": {"rgb": [0.6, 0.6, 0.6]}, "roughness": 0.3}},
    {"name": "red", "diffuse": {"reflectance": {"rgb": [0.6, 0.1, 0.1]}}},
    {"name": "green", "diffuse": {"reflectance": {"rgb": [0.1, 0.5, 0.1]}}},
    {"name": "gold", "conductor": {"metal": "gold", "roughness": 0.3}},
    {"name": "coated", "principled": {"base_color": {"rgb": [0.1, 0.2, 0.6]}, "roughness": 0.6, "coat": 1, "coat_roughness": 0.2}},
    {"name": "lamp", "diffuse": {"reflectance": {"rgb": [0, 0, 0]}}, "emission": {"rgb": [40, 40, 40]}}],
  "objects": [
    {"material": "wall", "plane": {"point": [0, 0, 0], "normal": [0, 1, 0]}},
    {"material": "wall", "plane": {"point": [0, 2.5, 0], "normal": [0, -1, 0]}},
    {"material": "red", "plane": {"point": [-1.5, 0, 0], "normal": [1, 0, 0]}},
    {"material": "green", "plane": {"point": [1.5, 0, 0], "normal": [-1, 0, 0]}},
    {"material": "wall", "plane": {"point": [0, 0, -1.5], "normal": [0, 0, 1]}},
    {"material": "wall", "plane": {"point": [0, 0, 3], "normal": [0, 0, -1]}},
    {"material": "gold", "sphere": {"center": [-0.6, 0.45, -0.3], "radius": 0.45}},
    {"material": "coated", "sphere": {"center": [0.6, 0.4, 0.3], "radius": 0.4}},
    {"material": "lamp", "sphere": {"center": [0.3, 2.1, 0.3], "radius": 0.15}}]})";

struct Case {
  const char* name;  ///< of a shipped scene, without a document
  const char* method;
  const char* document = nullptr;
};
const std::array<Case, 5> kCases{{{"cornell-bench-blocks", "path"},
                                  {"cornell-bench-balls", "path"},
                                  {"cornell-bench-balls", "caustic"},
                                  {"course-default", "path"},
                                  {"glossy room", "path", kGlossy}}};

/// The film of samples [0, 2^level) as planes.
struct Planes {
  int width = 0, height = 0;
  std::vector<float> half_a, half_b, features;
  std::vector<std::uint32_t> samples_a, samples_b;

  ReconstructionInput input() const { return {width, height, half_a, half_b, samples_a, samples_b, features}; }
  double mean(std::size_t i) const { return (static_cast<double>(half_a[i]) + static_cast<double>(half_b[i])) / 2; }
};

/// Copies a tile's planes: `to[channel][pixel] = from[channel][pixel] * scale`.
void place(std::span<const float> from, const PixelRect& rect, float scale, int width, std::size_t pixels,
           std::vector<float>& to) {
  const auto tile_pixels = static_cast<std::size_t>(rect.pixel_count());
  for (std::size_t i = 0; i < from.size(); ++i) {
    const std::size_t pixel = i % tile_pixels, x = pixel % static_cast<std::size_t>(rect.width),
                      y = pixel / static_cast<std::size_t>(rect.width);
    to[i / tile_pixels * pixels + (static_cast<std::size_t>(rect.y) + y) * static_cast<std::size_t>(width) +
       static_cast<std::size_t>(rect.x) + x] = from[i] * scale;
  }
}

Planes render(const TestScene& scene, const std::string& method_name, std::uint64_t seed, std::uint32_t level) {
  const std::vector<LayerSpec> layers = film_layers(std::vector<std::string>{"features"}).value();
  const auto method = make_method(scene.compiled(), {method_name, seed, 0, layers}).value();
  const auto workspace = method->make_workspace();
  Planes out{scene.compiled()->film_width(), scene.compiled()->film_height(), {}, {}, {}, {}, {}};
  const auto pixels = static_cast<std::size_t>(out.width) * static_cast<std::size_t>(out.height);
  out.half_a.resize(3 * pixels);
  out.half_b.resize(3 * pixels);
  out.features.resize(layers[1].channels * pixels);
  out.samples_a.assign(pixels, 1u << (level - 1));
  out.samples_b = out.samples_a;
  const TileGrid grid({0, 0, out.width, out.height});
  for (std::uint32_t tile = 0; tile < grid.tile_count(); ++tile) {
    const PixelRect rect = grid.tile_rect({tile});
    const Node node = method->render(rect, {level, 0}, *workspace);
    const auto half = static_cast<std::size_t>(3 * rect.pixel_count());
    const std::span<const float> values = node.values;
    const float scale = std::ldexp(1.0f, 1 - static_cast<int>(level));
    place(values.first(half), rect, scale, out.width, pixels, out.half_a);
    place(values.subspan(half, half), rect, scale, out.width, pixels, out.half_b);
    place(values.subspan(2 * half), rect, 1.0f / std::min(16.0f, std::ldexp(1.0f, static_cast<int>(level))), out.width,
          pixels, out.features);
  }
  return out;
}

template <class F>
double rel_mse(const Planes& reference, F&& value) {
  double sum = 0;
  for (std::size_t i = 0; i < reference.half_a.size(); ++i) {
    const double r = reference.mean(i);
    sum += (value(i) - static_cast<double>(reference.half_a[i])) *
           (value(i) - static_cast<double>(reference.half_b[i])) / (r * r + 0.01);
  }
  return sum / static_cast<double>(reference.half_a.size());
}

void write(const std::string& path, int width, int height, const std::vector<float>& values) {
  const std::string bytes = encode_png(width, height, to_srgb8({width, height, values}, {})).value();
  std::ofstream(path, std::ios::binary) << bytes;
}

std::vector<float> mean_of(const Planes& planes) {
  std::vector<float> mean(planes.half_a.size());
  for (std::size_t i = 0; i < mean.size(); ++i) {
    mean[i] = static_cast<float>(planes.mean(i));
  }
  return mean;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Compares raw and reconstructed pictures at equal samples."};
  int side = 128;
  std::uint32_t reference_level = 9;
  std::vector<std::uint32_t> levels{2, 4, 6, 8};
  std::string pictures, only;
  app.add_option("--side", side, "pixels")->check(CLI::Range(16, 4096))->capture_default_str();
  app.add_option("--reference", reference_level, "log2 of the reference's samples per pixel")
      ->check(CLI::Range(1u, 20u))
      ->capture_default_str();
  app.add_option("--levels", levels, "log2 of the samples per pixel")
      ->delimiter(',')
      ->check(CLI::Range(1u, 20u))
      ->capture_default_str();
  app.add_option("--pictures", pictures, "folder for PNG files");
  app.add_option("--only", only, "the scene with this name");
  CLI11_PARSE(app, argc, argv);
  std::printf("%-28s %8s %10s %10s %13s %6s %18s\n", "scene", "samples", "raw", "regression", "reconstructed", "ratio",
              "seconds/megapixel");
  for (const Case& each : kCases) {
    if (!only.empty() && only != each.name) {
      continue;
    }
    const TestScene scene =
        (each.document != nullptr ? TestScene::from_text(each.document)
                                  : TestScene(source_file(fmt::format("scenes/{}.json", each.name)), read_image))
            .resized(side, side);
    const Planes reference = render(scene, each.method, 1000, reference_level);
    for (const std::uint32_t level : levels) {
      const Planes film = render(scene, each.method, 1, level);
      const double begin = thread_cpu_seconds();
      const std::vector<float> picture = reconstruct(film.input());
      const double seconds = thread_cpu_seconds() - begin;
      const double raw = rel_mse(reference, [&](std::size_t i) { return film.mean(i); });
      const double better = rel_mse(reference, [&](std::size_t i) { return static_cast<double>(picture[i]); });
      const std::vector<float> unmixed = regress(film.input());
      const double regression = rel_mse(reference, [&](std::size_t i) { return static_cast<double>(unmixed[i]); });
      std::printf("%-28s %8u %10.3g %10.3g %13.3g %6.2f %18.2f\n",
                  (std::string(each.name) + " by " + each.method).c_str(), 1u << level, raw, regression, better,
                  raw / better, seconds * 1e6 / (side * side));
      std::fflush(stdout);
      if (!pictures.empty()) {
        const std::string stem = fmt::format("{}/{}-{}-{}", pictures, each.name, each.method, 1u << level);
        write(stem + "-raw.png", side, side, mean_of(film));
        write(stem + "-reconstructed.png", side, side, picture);
        write(stem + "-reference.png", side, side, mean_of(reference));
      }
    }
  }
}

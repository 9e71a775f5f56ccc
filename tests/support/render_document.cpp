#include "tests/support/render_document.h"

#include <cmath>
#include <fstream>

#include "common/base/check.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace fs = std::filesystem;
namespace {

LoadedScene value_of(Result<LoadedScene> loaded) {
  LM_CHECK(loaded.ok(), "{}", message_of(loaded.status()));
  return std::move(*loaded);
}

LoadedScene load(const fs::path& path) {
  return value_of(load_scene(std::span(&path, 1)));
}

/// Loads a document's text and its files from a temporary folder. Errors leave the folder's name out.
Result<LoadedScene> read_text(const std::string& document, const std::map<std::string, std::string>& files) {
  const TemporaryFolder folder;
  for (const auto& [name, text] : files) {
    std::ofstream(folder.path() / name) << text;
  }
  const fs::path path = folder.path() / "scene.json";
  std::ofstream(path) << document;
  auto loaded = load_scene(std::span(&path, 1));
  if (loaded.ok()) {
    return loaded;
  }
  std::string message = message_of(loaded.status());
  const std::string prefix = folder.path().string() + "/";
  for (std::size_t at = 0; (at = message.find(prefix)) != std::string::npos;) {
    message.erase(at, prefix.size());
  }
  return invalid_argument("{}", message);
}

/// Source of a loaded scene's assets.
CompiledScene::AssetSource source_of(const LoadedScene& loaded) {
  return [&loaded](const Sha256& digest) -> Result<std::string> { return loaded.assets.at(digest); };
}

}  // namespace

TestScene::TestScene(LoadedScene loaded, const CompiledScene::ImageDecoder& images)
    : loaded_(std::move(loaded)), images_(images) {
  auto compiled = CompiledScene::compile(loaded_.scene, assets(), images);
  LM_CHECK(compiled.ok(), "{}", message_of(compiled.status()));
  compiled_ = *compiled;
}

TestScene::TestScene(const fs::path& path, const CompiledScene::ImageDecoder& images) : TestScene(load(path), images) {}

LoadedScene load_text(const std::string& document, const std::map<std::string, std::string>& files) {
  return value_of(read_text(document, files));
}

std::string refusal(const std::string& document, const std::map<std::string, std::string>& files,
                    const CompiledScene::ImageDecoder& images) {
  const auto loaded = read_text(document, files);
  if (!loaded.ok()) {
    return message_of(loaded.status());
  }
  const auto compiled = CompiledScene::compile(loaded->scene, source_of(*loaded), images);
  return compiled.ok() ? "" : message_of(compiled.status());
}

TestScene TestScene::from_text(const std::string& document, const std::map<std::string, std::string>& files,
                               const CompiledScene::ImageDecoder& images) {
  return TestScene(load_text(document, files), images);
}

CompiledScene::AssetSource TestScene::assets() const {
  return source_of(loaded_);
}

TestScene TestScene::resized(int width, int height) const {
  LoadedScene loaded = loaded_;
  loaded.scene.film.width = width;
  loaded.scene.film.height = height;
  return TestScene(std::move(loaded), images_);
}

HalfImages TestScene::render(const MethodSettings& settings, std::uint32_t level, PixelRect rect,
                             std::size_t channel) const {
  LM_CHECK(level >= 1);
  if (rect.width == 0) {
    rect = {0, 0, loaded_.scene.film.width, loaded_.scene.film.height};
  }
  auto method = make_method(compiled_, settings);
  LM_CHECK(method.ok(), "{}", message_of(method.status()));
  const auto workspace = (*method)->make_workspace();
  HalfImages image{rect.width, rect.height, {}, {}, 0};
  image.a.resize(3 * static_cast<std::size_t>(rect.pixel_count()));
  image.b.resize(image.a.size());
  const double samples_per_half = std::ldexp(1.0, static_cast<int>(level) - 1);
  const TileGrid grid(rect);
  const std::size_t half_b = NodeLayout(settings.layers).summed + channel;
  for (std::uint32_t i = 0; i < grid.tile_count(); ++i) {
    const PixelRect tile = grid.tile_rect({i});
    const Node node = (*method)->render(tile, {level, 0}, *workspace);
    image.non_finite += node.non_finite;
    const auto pixels = static_cast<std::size_t>(tile.pixel_count());
    for (std::size_t p = 0; p < pixels; ++p) {
      const std::size_t x = tile.x - rect.x + p % tile.width;
      const std::size_t y = tile.y - rect.y + p / tile.width;
      for (std::size_t c = 0; c < 3; ++c) {
        const std::size_t out = (y * rect.width + x) * 3 + c;
        image.a[out] = node.values[(channel + c) * pixels + p] / samples_per_half;
        image.b[out] = node.values[(half_b + c) * pixels + p] / samples_per_half;
      }
    }
  }
  return image;
}

Estimate mean_of(const HalfImages& image, int channel) {
  double sum = 0, variance = 0;
  const std::size_t pixels = image.a.size() / 3;
  for (std::size_t p = 0; p < pixels; ++p) {
    sum += image.mean(3 * p + channel);
    variance += image.variance(3 * p + channel);
  }
  return {sum / pixels, std::sqrt(variance) / pixels};
}

}  // namespace lightmill::test

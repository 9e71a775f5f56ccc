#include "common/image/picture_layers.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/image/cryptomatte.h"

namespace lightmill {
namespace {

constexpr std::string_view kLightPrefix = "light:";
constexpr std::string_view kObjectLayer = "CryptoObject";
constexpr std::string_view kMaterialLayer = "CryptoMaterial";

std::vector<std::string> rgb_of(const std::string& prefix) {
  return {prefix + ".R", prefix + ".G", prefix + ".B"};
}

std::vector<std::string> channels_of(std::string_view name) {
  if (name.starts_with(kLightPrefix)) {
    return rgb_of("Light." + std::string(name.substr(kLightPrefix.size())));
  }
  if (name == "normal") {
    return {"N.X", "N.Y", "N.Z"};
  }
  if (name == "features") {
    std::vector<std::string> channels;
    for (const char* half : {"A", "B"}) {
      for (const char* channel : {"Albedo.R", "Albedo.G", "Albedo.B", "N.X", "N.Y", "N.Z", "InverseZ", "Square.Albedo",
                                  "Square.N", "Square.InverseZ"}) {
        channels.push_back(fmt::format("Features.{}.{}", half, channel));
      }
    }
    return channels;
  }
  if (name == "depth") {
    return {"Z"};
  }
  if (name == "id") {
    std::vector<std::string> channels = cryptomatte_channels(kObjectLayer);
    const std::vector<std::string> materials = cryptomatte_channels(kMaterialLayer);
    channels.insert(channels.end(), materials.begin(), materials.end());
    return channels;
  }
  LM_CHECK(!name.empty());
  std::string prefix(name);
  prefix[0] = static_cast<char>(prefix[0] - 'a' + 'A');
  return rgb_of(prefix);
}

/// Visits the pixels of a tile: f(pixel of the tile, pixel of the data window).
template <class F>
void for_each_pixel(const ImageWindow& data, const ImageWindow& rect, F&& f) {
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x) {
      f(static_cast<std::size_t>(y) * rect.width + x,
        static_cast<std::size_t>(rect.y - data.y + y) * data.width + (rect.x - data.x + x));
    }
  }
}

/// Stores the identifiers of one pixel's samples, of objects and of materials.
void place_ids(PictureLayer& layer, std::size_t to, std::span<const float> sample_ids, PictureIds& ids) {
  const std::size_t pixels = layer.values.size() / layer.channels.size();
  std::array<std::array<float, kMaxCryptomatteSamples>, 2> identifiers{};
  for (std::size_t i = 0; i < sample_ids.size(); ++i) {
    if (const std::optional<std::size_t> object = ids.see(sample_ids[i])) {
      identifiers[0][i] = ids.identifier(PictureIds::kObject, *object);
      identifiers[1][i] = ids.identifier(PictureIds::kMaterial, *object);
    }
  }
  std::size_t channel = 0;
  for (const auto& of_kind : identifiers) {
    for (const float value : cryptomatte_ranks(std::span(of_kind).first(sample_ids.size()))) {
      layer.values[channel++ * pixels + to] = value;
    }
  }
}

}  // namespace

PictureIds::PictureIds(std::vector<std::string> objects, std::vector<std::string> materials)
    : names_{std::move(objects), std::move(materials)} {
  LM_CHECK(names_[kObject].size() == names_[kMaterial].size());
  for (const Kind kind : {kObject, kMaterial}) {
    std::ranges::transform(names_[kind], std::back_inserter(identifiers_[kind]), cryptomatte_id);
  }
  seen_.resize(names_[kObject].size());
}

std::optional<std::size_t> PictureIds::see(float id) {
  if (!(id >= 1 && id <= static_cast<float>(seen_.size()))) {
    return std::nullopt;
  }
  const std::size_t object = static_cast<std::size_t>(id) - 1;
  seen_[object] = true;
  return object;
}

std::set<std::string> PictureIds::seen(Kind kind) const {
  std::set<std::string> out;
  for (std::size_t i = 0; i < seen_.size(); ++i) {
    if (seen_[i]) {
      out.insert(names_[kind][i]);
    }
  }
  return out;
}

bool is_shown_layer(std::string_view name) {
  return name != "features" && name != "id";
}

bool is_mean_layer(std::string_view name) {
  return name != "normal" && name != "features" && name != "depth" && name != "id";
}

PictureLayer make_picture_layer(const std::string& name, std::size_t pixels) {
  PictureLayer layer{name, channels_of(name), {}};
  layer.values.resize(layer.channels.size() * pixels, name == "depth" ? kNoDepth : 0.0f);
  return layer;
}

bool place_first_samples(std::vector<PictureLayer>& layers, const ImageWindow& data, const ImageWindow& rect,
                         std::uint32_t samples, std::span<const float> values, PictureIds& ids) {
  const auto tile_pixels = static_cast<std::size_t>(rect.pixel_count());
  const auto pixels = static_cast<std::size_t>(data.pixel_count());
  std::size_t expected = 0;
  for (const PictureLayer& layer : layers) {
    expected += is_mean_layer(layer.name) ? 0 : layer.name == "id" ? samples : layer.channels.size();
  }
  if (samples == 0 || samples > kMaxCryptomatteSamples || values.size() != expected * tile_pixels) {
    return samples == 0 && values.empty();
  }
  for (PictureLayer& layer : layers) {
    if (layer.name == "normal" || layer.name == "features") {
      for_each_pixel(data, rect, [&](std::size_t from, std::size_t to) {
        for (std::size_t c = 0; c < layer.channels.size(); ++c) {
          layer.values[c * pixels + to] = values[c * tile_pixels + from] / static_cast<float>(samples);
        }
      });
      values = values.subspan(layer.channels.size() * tile_pixels);
    } else if (layer.name == "depth") {
      for_each_pixel(data, rect, [&](std::size_t from, std::size_t to) {
        layer.values[to] = values[from] == 0 ? kNoDepth : values[from];
      });
      values = values.subspan(tile_pixels);
    } else if (layer.name == "id") {
      std::array<float, kMaxCryptomatteSamples> sample_ids{};
      for_each_pixel(data, rect, [&](std::size_t from, std::size_t to) {
        for (std::uint32_t i = 0; i < samples; ++i) {
          sample_ids[i] = values[i * tile_pixels + from];
        }
        place_ids(layer, to, std::span(sample_ids).first(samples), ids);
      });
    }
  }
  return true;
}

void add_id_attributes(std::map<std::string, ImageAttribute>& attributes, const PictureIds& ids) {
  add_cryptomatte_attributes(attributes, kObjectLayer, ids.seen(PictureIds::kObject));
  add_cryptomatte_attributes(attributes, kMaterialLayer, ids.seen(PictureIds::kMaterial));
}

}  // namespace lightmill

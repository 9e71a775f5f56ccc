#include "common/image/picture_layers.h"

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

/// The identifiers that ids of one pixel's samples stand for, of objects or of materials.
void ranks_of_pixel(PictureLayer& layer, std::size_t first_channel, std::size_t to, std::span<const float> ids,
                    const std::vector<std::string>& names, std::set<std::string>& seen) {
  const std::size_t pixels = layer.values.size() / layer.channels.size();
  std::vector<float> identifiers;
  for (const float id : ids) {
    const auto index = static_cast<std::size_t>(id);
    const bool sees = index >= 1 && index <= names.size();
    identifiers.push_back(sees ? cryptomatte_id(names[index - 1]) : 0.0f);
    if (sees) {
      seen.insert(names[index - 1]);
    }
  }
  const auto ranks = cryptomatte_ranks(identifiers);
  for (std::size_t i = 0; i < ranks.size(); ++i) {
    layer.values[(first_channel + i) * pixels + to] = ranks[i];
  }
}

}  // namespace

bool is_mean_layer(std::string_view name) {
  return name != "normal" && name != "depth" && name != "id";
}

PictureLayer make_picture_layer(const std::string& name, std::size_t pixels) {
  PictureLayer layer{name, channels_of(name), {}};
  layer.values.resize(layer.channels.size() * pixels, name == "depth" ? kNoDepth : 0.0f);
  return layer;
}

bool place_first_samples(std::vector<PictureLayer>& layers, const ImageWindow& data, const ImageWindow& rect,
                         std::uint32_t samples, std::span<const float> values, const IdNames& names,
                         std::array<std::set<std::string>, 2>& seen) {
  const auto tile_pixels = static_cast<std::size_t>(rect.pixel_count());
  const auto pixels = static_cast<std::size_t>(data.pixel_count());
  std::size_t expected = 0;
  for (const PictureLayer& layer : layers) {
    expected += layer.name == "normal" ? 3 : layer.name == "depth" ? 1 : layer.name == "id" ? samples : 0;
  }
  if (samples == 0 || values.size() != expected * tile_pixels) {
    return samples == 0 && values.empty();
  }
  for (PictureLayer& layer : layers) {
    if (layer.name == "normal") {
      for_each_pixel(data, rect, [&](std::size_t from, std::size_t to) {
        for (std::size_t c = 0; c < 3; ++c) {
          layer.values[c * pixels + to] = values[c * tile_pixels + from] / static_cast<float>(samples);
        }
      });
      values = values.subspan(3 * tile_pixels);
    } else if (layer.name == "depth") {
      for_each_pixel(data, rect, [&](std::size_t from, std::size_t to) {
        layer.values[to] = values[from] == 0 ? kNoDepth : values[from];
      });
      values = values.subspan(tile_pixels);
    } else if (layer.name == "id") {
      std::vector<float> ids(samples);
      for_each_pixel(data, rect, [&](std::size_t from, std::size_t to) {
        for (std::uint32_t i = 0; i < samples; ++i) {
          ids[i] = values[i * tile_pixels + from];
        }
        ranks_of_pixel(layer, 0, to, ids, names.objects, seen[0]);
        ranks_of_pixel(layer, 2 * kCryptomatteRanks, to, ids, names.materials, seen[1]);
      });
    }
  }
  return true;
}

void add_id_attributes(std::map<std::string, ImageAttribute>& attributes,
                       const std::array<std::set<std::string>, 2>& seen) {
  add_cryptomatte_attributes(attributes, kObjectLayer, seen[0]);
  add_cryptomatte_attributes(attributes, kMaterialLayer, seen[1]);
}

}  // namespace lightmill

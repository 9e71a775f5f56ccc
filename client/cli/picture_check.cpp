#include "client/cli/picture_check.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/base/file.h"
#include "common/image/exr.h"
#include "common/wire/film_assembly.h"

namespace lightmill::cli {
namespace {

/// The mix of a counter of Steele et al., "Fast splittable pseudorandom number generators" (2014).
std::uint64_t mix(std::uint64_t counter) {
  counter = (counter ^ (counter >> 30)) * 0xbf58476d1ce4e5b9u;
  counter = (counter ^ (counter >> 27)) * 0x94d049bb133111ebu;
  return counter ^ (counter >> 31);
}

TileGrid grid_of_picture(const FilmPicture& picture) {
  return TileGrid({picture.data.x, picture.data.y, picture.data.width, picture.data.height});
}

Status check_counts(const FilmPicture& picture) {
  std::uint64_t least = std::numeric_limits<std::uint64_t>::max(), most = 0;
  for (std::size_t i = 0; i < picture.pixels(); ++i) {
    const std::uint64_t samples = std::uint64_t{picture.samples_a[i]} + picture.samples_b[i];
    least = std::min(least, samples);
    most = std::max(most, samples);
  }
  // The receipt's counts include the tiles of meters, which are no pixels.
  const bool fits = picture.receipt.meter_hashes.empty()
                        ? least == picture.receipt.min_samples && most == picture.receipt.max_samples
                        : least >= picture.receipt.min_samples && most <= picture.receipt.max_samples;
  return fits ? ok_status()
              : data_loss("its pixels have {} to {} samples, but its receipt says {} to {}", least, most,
                          picture.receipt.min_samples, picture.receipt.max_samples);
}

Result<FilmPicture> sound_picture(ByteView bytes) {
  if (bytes.size() >= 4 && !is_exr(bytes)) {
    return invalid_argument("this is not an EXR file: give one that `lightmill render -o` or `fetch -o` wrote");
  }
  const Result<Image> decoded = decode_exr(bytes);
  if (!decoded.ok()) {
    return data_loss("the file was damaged or changed after it was written: {}. Fetch or render it again",
                     message_of(decoded.status()));
  }
  const Image& image = *decoded;
  const std::string stated = image.text(kFileChecksum);
  if (stated.empty()) {
    constexpr const char* kWhy =
        "it has no {}: it was not written by Lightmill, or by a version without verification{}";
    return image.text("lightmill.renderDigest").empty() ? invalid_argument(kWhy, kFileChecksum, "")
                                                        : data_loss(kWhy, kFileChecksum, ", or it was removed");
  }
  if (stated != file_checksum(image)) {
    return data_loss("a pixel or an attribute was changed after the file was written: its checksum is {}, not {}",
                     file_checksum(image), stated);
  }
  LM_RETURN_IF_ERROR(check_exr_form(bytes, image));
  LM_ASSIGN_OR_RETURN(FilmPicture picture, from_image(image));
  if (const std::string hash = film_hash_of(picture).hex(); hash != picture.receipt.film_hash) {
    return data_loss("a pixel was changed: its film hash is {}, but its receipt says {}", hash,
                     picture.receipt.film_hash);
  }
  LM_RETURN_IF_ERROR(check_counts(picture));
  return picture;
}

/// The number of values of one channel that differ within `rect`, which is all of `again`.
template <class T>
std::size_t count_differing(const std::vector<T>& values, const FilmPicture& picture, const std::vector<T>& again,
                            const PixelRect& rect, std::size_t channel) {
  std::size_t differing = 0;
  const auto tile_pixels = static_cast<std::size_t>(rect.pixel_count());
  for (int y = 0; y < rect.height; ++y) {
    const std::size_t row = channel * picture.pixels() +
                            static_cast<std::size_t>(rect.y - picture.data.y + y) * picture.data.width +
                            (rect.x - picture.data.x);
    const std::size_t row_again = channel * tile_pixels + static_cast<std::size_t>(y) * rect.width;
    for (int x = 0; x < rect.width; ++x) {
      differing += std::bit_cast<std::uint32_t>(values[row + x]) != std::bit_cast<std::uint32_t>(again[row_again + x]);
    }
  }
  return differing;
}

}  // namespace

Result<FilmPicture> load_sound_picture(const std::string& path) {
  LM_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  Result<FilmPicture> picture = sound_picture(as_byte_view(bytes));
  if (!picture.ok()) {
    return make_error(picture.status().code(), "{}: {}", path, message_of(picture.status()));
  }
  return picture;
}

Result<RenderSettings> settings_of(const FilmPicture& picture, const std::string& scene,
                                   const std::vector<Sha256>& assets) {
  const Receipt& receipt = picture.receipt;
  if (const std::string digest = sha256(scene).hex(); digest != receipt.scene_digest) {
    return data_loss(
        "this is not the scene of the picture: the scene has the digest {:.12}…, the picture was made from {:.12}…. "
        "Give the file as it was, and the same --camera, --mtl, --sky, --at and --animation",
        digest, receipt.scene_digest);
  }
  std::vector<std::string> digests;
  for (const Sha256& asset : assets) {
    digests.push_back(asset.hex());
  }
  if (digests != receipt.asset_digests) {
    return data_loss(
        "the scene's meshes or images are not those of the picture. Give the files as they were at the render");
  }
  RenderSettings settings;
  settings.scene = scene;
  settings.assets = assets;
  settings.width = picture.display.width;
  settings.height = picture.display.height;
  settings.crop = {picture.data.x, picture.data.y, picture.data.width, picture.data.height};
  std::vector<std::string> names;
  for (const PictureLayer& layer : picture.layers) {
    names.push_back(layer.name);
  }
  LM_ASSIGN_OR_RETURN(settings.layers, film_layers(names));
  settings.meters = static_cast<std::uint32_t>(receipt.meter_hashes.size());
  settings.seed = receipt.seed;
  settings.method = receipt.method;
  settings.max_bounces = receipt.max_bounces;
  settings.renderer_version = receipt.renderer_version;
  if (const std::string digest = render_digest(settings, receipt.fingerprint_class).hex();
      digest != receipt.render_digest) {
    return data_loss(
        "the receipt contradicts itself: its scene, method, seed, layers and class have the digest {}, not {}", digest,
        receipt.render_digest);
  }
  return settings;
}

std::vector<TileId> draw_tiles(const FilmPicture& picture, double share, std::uint64_t seed) {
  const std::uint32_t count = grid_of_picture(picture).picture_tiles();
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
  for (std::uint32_t tile = 0; tile < count; ++tile) {
    order.emplace_back(mix(seed * 0x9e3779b97f4a7c15u + tile + 1), tile);
  }
  std::ranges::sort(order);
  const auto drawn = static_cast<std::size_t>(std::clamp(std::ceil(share * count), 1.0, static_cast<double>(count)));
  std::vector<TileId> tiles;
  for (const auto& [key, tile] : std::span(order).first(drawn)) {
    tiles.push_back(TileId{tile});
  }
  std::ranges::sort(tiles);
  return tiles;
}

Result<std::uint64_t> samples_of(const FilmPicture& picture, const PixelRect& rect) {
  const auto index = [&](int x, int y) {
    return static_cast<std::size_t>(y - picture.data.y) * picture.data.width + (x - picture.data.x);
  };
  const std::uint64_t a = picture.samples_a[index(rect.x, rect.y)], b = picture.samples_b[index(rect.x, rect.y)];
  bool even = a + b > 0 && (a == b || a == b + 1);
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      even = even && picture.samples_a[index(x, y)] == a && picture.samples_b[index(x, y)] == b;
    }
  }
  if (!even) {
    return failed_precondition(
        "the pixels at {}, {} do not have the same first samples: the picture was fetched before its job had ended",
        rect.x, rect.y);
  }
  return a + b;
}

std::string compare_tile(const FilmPicture& picture, const FilmPicture& again, const PixelRect& rect) {
  std::vector<std::string> differing;
  const auto note = [&](const std::string& what, std::size_t values) {
    if (values > 0) {
      differing.push_back(fmt::format("{} ({} values)", what, values));
    }
  };
  if (again.pixels() != static_cast<std::size_t>(rect.pixel_count()) || again.layers.size() != picture.layers.size()) {
    return "other pixels or layers";
  }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const char name = "RGB"[channel];
    note(fmt::format("{}", name), count_differing(picture.beauty, picture, again.beauty, rect, channel));
    note(fmt::format("A.{}", name), count_differing(picture.half_a, picture, again.half_a, rect, channel));
    note(fmt::format("B.{}", name), count_differing(picture.half_b, picture, again.half_b, rect, channel));
  }
  note("A.samples", count_differing(picture.samples_a, picture, again.samples_a, rect, 0));
  note("B.samples", count_differing(picture.samples_b, picture, again.samples_b, rect, 0));
  for (std::size_t i = 0; i < picture.layers.size(); ++i) {
    const PictureLayer& layer = picture.layers[i];
    for (std::size_t channel = 0; channel < layer.channels.size(); ++channel) {
      note(layer.channels[channel], count_differing(layer.values, picture, again.layers[i].values, rect, channel));
    }
  }
  return fmt::format("{}", fmt::join(differing, ", "));
}

}  // namespace lightmill::cli

#include "common/image/film_picture.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>

#include "common/base/check.h"
#include "common/base/digest.h"
#include "common/base/text.h"
#include "common/image/color.h"

namespace lightmill {
namespace {

constexpr std::array<const char*, 3> kRgb{"R", "G", "B"};
constexpr const char* kDenoisedPrefix = "Denoised.";
constexpr const char* kLayersAttribute = "lightmill.layers";  ///< names, separated by spaces

/// Attributes that OpenEXR writes by itself.
bool is_of_openexr(std::string_view name) {
  return name == "pixelAspectRatio" || name == "screenWindowWidth";
}

std::uint64_t parse_count(const std::string& text) {
  std::uint64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

double number_or(const Image& image, const std::string& name, double otherwise) {
  const auto found = image.attributes.find(name);
  const double* value = found == image.attributes.end() ? nullptr : std::get_if<double>(&found->second);
  return value == nullptr ? otherwise : *value;
}

std::vector<std::string> split_at(char separator, const std::string& text) {
  std::vector<std::string> words;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find(separator, at), text.size());
    words.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return words;
}
std::vector<std::string> split_words(const std::string& text) {
  return split_at(' ', text);
}

std::map<std::string, ImageAttribute> receipt_attributes(const Receipt& receipt) {
  std::map<std::string, ImageAttribute> out{
      {"software", fmt::format("Lightmill ({})", receipt.renderer_version)},
      {"samplesPerPixel", static_cast<int>(std::min<std::uint64_t>(receipt.max_samples, 1u << 30))},
      {"renderTimeSeconds", static_cast<float>(receipt.seconds)},
      {"lightmill.renderDigest", receipt.render_digest},
      {"lightmill.sceneDigest", receipt.scene_digest},
      {"lightmill.assetDigests", fmt::format("{}", fmt::join(receipt.asset_digests, " "))},
      {"lightmill.filmHash", receipt.film_hash},
      {"lightmill.rendererVersion", receipt.renderer_version},
      {"lightmill.fingerprintClass", receipt.fingerprint_class},
      {"lightmill.method", receipt.method},
      {"lightmill.seed", std::to_string(receipt.seed)},
      {"lightmill.job", std::to_string(receipt.job)},
      {"lightmill.name", receipt.name},
      {"lightmill.host", receipt.host},
      {"lightmill.minSamples", std::to_string(receipt.min_samples)},
      {"lightmill.maxSamples", std::to_string(receipt.max_samples)},
      {"lightmill.workerSeconds", receipt.worker_seconds},
      {"lightmill.seconds", receipt.seconds},
  };
  if (!receipt.method_reasons.empty()) {
    out["lightmill.methodReasons"] = fmt::format("{}", fmt::join(receipt.method_reasons, "\n"));
  }
  if (!receipt.notices.empty()) {
    out["lightmill.notices"] = fmt::format("{}", fmt::join(receipt.notices, "\n"));
  }
  if (receipt.max_bounces > 0) {
    out["lightmill.maxBounces"] = std::to_string(receipt.max_bounces);
  }
  if (!receipt.meter_hashes.empty()) {
    out["lightmill.meterHashes"] = fmt::format("{}", fmt::join(receipt.meter_hashes, " "));
  }
  if (!receipt.owner.empty()) {
    out["owner"] = receipt.owner;
  }
  if (!receipt.capture_date.empty()) {
    out["capDate"] = receipt.capture_date;
  }
  if (!receipt.ended.empty()) {
    out["lightmill.ended"] = receipt.ended;
  }
  if (receipt.rel_mse >= 0) {
    out["lightmill.relMse"] = receipt.rel_mse;
    out["lightmill.relMseHalfWidth"] = receipt.rel_mse_half_width;
  }
  return out;
}

Receipt read_receipt(const Image& image) {
  Receipt receipt;
  receipt.render_digest = image.text("lightmill.renderDigest");
  receipt.scene_digest = image.text("lightmill.sceneDigest");
  receipt.asset_digests = split_words(image.text("lightmill.assetDigests"));
  receipt.film_hash = image.text("lightmill.filmHash");
  receipt.meter_hashes = split_words(image.text("lightmill.meterHashes"));
  receipt.renderer_version = image.text("lightmill.rendererVersion");
  receipt.fingerprint_class = image.text("lightmill.fingerprintClass");
  receipt.method = image.text("lightmill.method");
  receipt.method_reasons = split_at('\n', image.text("lightmill.methodReasons"));
  receipt.notices = split_at('\n', image.text("lightmill.notices"));
  receipt.max_bounces = static_cast<std::uint32_t>(parse_count(image.text("lightmill.maxBounces")));
  receipt.seed = parse_count(image.text("lightmill.seed"));
  receipt.job = parse_count(image.text("lightmill.job"));
  receipt.name = image.text("lightmill.name");
  receipt.owner = image.text("owner");
  receipt.host = image.text("lightmill.host");
  receipt.min_samples = parse_count(image.text("lightmill.minSamples"));
  receipt.max_samples = parse_count(image.text("lightmill.maxSamples"));
  receipt.rel_mse = number_or(image, "lightmill.relMse", -1);
  receipt.rel_mse_half_width = number_or(image, "lightmill.relMseHalfWidth", -1);
  receipt.ended = image.text("lightmill.ended");
  receipt.seconds = number_or(image, "lightmill.seconds", 0);
  receipt.worker_seconds = number_or(image, "lightmill.workerSeconds", 0);
  receipt.capture_date = image.text("capDate");
  return receipt;
}

void add_rgb(Image& image, const std::string& prefix, const std::vector<float>& planar, std::size_t pixels) {
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto first = planar.begin() + static_cast<std::ptrdiff_t>(channel * pixels);
    image.channels.push_back(
        {prefix + kRgb[channel], std::vector<float>(first, first + static_cast<std::ptrdiff_t>(pixels))});
  }
}

Status take_rgb(const Image& image, const std::string& prefix, std::vector<float>& planar) {
  planar.clear();
  for (const char* name : kRgb) {
    const std::vector<float>* values = image.floats(prefix + name);
    if (values == nullptr) {
      return invalid_argument("the file has no channel {}{}", prefix, name);
    }
    planar.insert(planar.end(), values->begin(), values->end());
  }
  return ok_status();
}

Status take_counts(const Image& image, const std::string& name, std::vector<std::uint32_t>& out) {
  const std::vector<std::uint32_t>* values = image.counts(name);
  if (values == nullptr) {
    return invalid_argument("the file has no integer channel {}", name);
  }
  out = *values;
  return ok_status();
}

Status take_layer(const Image& image, const std::string& name, FilmPicture& picture) {
  if (name.empty() || !(name[0] >= 'a' && name[0] <= 'z')) {
    return invalid_argument("the file has an unknown layer \"{}\"", printable(name));
  }
  PictureLayer layer = make_picture_layer(name, 0);
  for (const std::string& channel : layer.channels) {
    const std::vector<float>* values = image.floats(channel);
    if (values == nullptr) {
      return invalid_argument("the file has no channel {}", printable(channel));
    }
    layer.values.insert(layer.values.end(), values->begin(), values->end());
  }
  picture.layers.push_back(std::move(layer));
  return ok_status();
}

/// Sums over windows of 2r+1 along one axis of a grid, clipped at the ends. `stride`: step along the axis. `other`:
/// step across it.
void box_sum(std::vector<double>& grid, int length, std::size_t stride, int lines, std::size_t other) {
  std::vector<double> prefix(static_cast<std::size_t>(length) + 1, 0.0);
  for (int line = 0; line < lines; ++line) {
    const std::size_t start = static_cast<std::size_t>(line) * other;
    for (int i = 0; i < length; ++i) {
      prefix[i + 1] = prefix[i] + grid[start + i * stride];
    }
    for (int i = 0; i < length; ++i) {
      const int low = std::max(i - kErrorSmoothingRadius, 0);
      const int high = std::min(i + kErrorSmoothingRadius + 1, length);
      grid[start + i * stride] = prefix[high] - prefix[low];
    }
  }
}

void box_sum_2d(std::vector<double>& grid, const ImageWindow& window) {
  const auto width = static_cast<std::size_t>(window.width);
  box_sum(grid, window.width, 1, window.height, width);
  box_sum(grid, window.height, width, window.width, 1);
}

}  // namespace

std::string file_checksum(const Image& image) {
  Sha256Hasher hasher;
  const auto append = [&](ByteView bytes) {
    const std::array size{std::uint64_t{bytes.size()}};
    hasher.append(std::as_bytes(std::span(size)));
    hasher.append(bytes);
  };
  for (const ImageWindow& window : {image.display, image.data}) {
    const std::array sides{window.x, window.y, window.width, window.height};
    append(std::as_bytes(std::span(sides)));
  }
  std::map<std::string, const ImageChannel*> channels;
  for (const ImageChannel& channel : image.channels) {
    channels[channel.name] = &channel;
  }
  const auto append_kind = [&](std::size_t index) {
    const std::array kind{std::uint64_t{index}};
    append(std::as_bytes(std::span(kind)));
  };
  for (const auto& [name, channel] : channels) {
    append(as_byte_view(name));
    append_kind(channel->values.index());
    std::visit([&](const auto& values) { append(std::as_bytes(std::span(values))); }, channel->values);
  }
  for (const auto& [name, attribute] : image.attributes) {
    if (name == kFileChecksum || is_of_openexr(name)) {
      continue;
    }
    append(as_byte_view(name));
    append_kind(attribute.index());
    std::visit(
        [&](const auto& value) {
          using Value = std::decay_t<decltype(value)>;
          if constexpr (std::is_arithmetic_v<Value>) {
            append(std::as_bytes(std::span(&value, 1)));
          } else {
            append(std::as_bytes(std::span(value)));
          }
        },
        attribute);
  }
  return hasher.finish().hex();
}

FilmPicture::FilmPicture(ImageWindow display, ImageWindow data)
    : display(display),
      data(data),
      beauty(3 * static_cast<std::size_t>(data.pixel_count())),
      half_a(beauty.size()),
      half_b(beauty.size()),
      samples_a(static_cast<std::size_t>(data.pixel_count())),
      samples_b(samples_a.size()) {}

std::size_t summed_channels(const FilmPicture& picture) {
  std::size_t channels = 3;
  for (const PictureLayer& layer : picture.layers) {
    channels += is_mean_layer(layer.name) ? layer.channels.size() : 0;
  }
  return channels;
}

void place_sums(FilmPicture& picture, const ImageWindow& rect, std::uint64_t count_a, std::uint64_t count_b,
                std::span<const float> sums) {
  const ImageWindow& data = picture.data;
  const auto tile_pixels = static_cast<std::size_t>(rect.pixel_count());
  const std::size_t half = summed_channels(picture) * tile_pixels;
  LM_CHECK(sums.size() == 2 * half, "{} sums for {} pixels", sums.size(), tile_pixels);
  LM_CHECK(rect.x >= data.x && rect.y >= data.y && rect.x + rect.width <= data.x + data.width &&
           rect.y + rect.height <= data.y + data.height);
  // The float32 quotient, as the film hash defines the means of halves.
  const auto mean = [](float sum, std::uint64_t count) { return count == 0 ? 0.0f : sum / static_cast<float>(count); };
  const auto place_mean = [&](std::size_t from, float* to) {
    for (int y = 0; y < rect.height; ++y) {
      for (int x = 0; x < rect.width; ++x, ++from) {
        to[static_cast<std::size_t>(rect.y - data.y + y) * data.width + (rect.x - data.x + x)] =
            mean(sums[from] + sums[half + from], count_a + count_b);
      }
    }
  };
  for (int y = 0; y < rect.height; ++y) {
    for (int x = 0; x < rect.width; ++x) {
      const std::size_t from = static_cast<std::size_t>(y) * rect.width + x;
      const std::size_t to = static_cast<std::size_t>(rect.y - data.y + y) * data.width + (rect.x - data.x + x);
      picture.samples_a[to] = static_cast<std::uint32_t>(count_a);
      picture.samples_b[to] = static_cast<std::uint32_t>(count_b);
      for (std::size_t channel = 0; channel < 3; ++channel) {
        const std::size_t value = channel * picture.pixels() + to;
        picture.half_a[value] = mean(sums[channel * tile_pixels + from], count_a);
        picture.half_b[value] = mean(sums[half + channel * tile_pixels + from], count_b);
      }
    }
  }
  std::size_t channel = 0;
  for (; channel < 3; ++channel) {
    place_mean(channel * tile_pixels, picture.beauty.data() + channel * picture.pixels());
  }
  for (PictureLayer& layer : picture.layers) {
    for (std::size_t i = 0; is_mean_layer(layer.name) && i < layer.channels.size(); ++i, ++channel) {
      place_mean(channel * tile_pixels, layer.values.data() + i * picture.pixels());
    }
  }
}

std::vector<float> smoothed_standard_error(const FilmPicture& picture) {
  const std::size_t pixels = picture.pixels();
  std::vector<double> known(pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    known[i] = picture.samples_a[i] > 0 && picture.samples_b[i] > 0 ? 1.0 : 0.0;
  }
  std::vector<double> weight = known;
  box_sum_2d(weight, picture.data);
  std::vector<float> out(3 * pixels);
  std::vector<double> variance(pixels);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (std::size_t i = 0; i < pixels; ++i) {
      const double a = picture.samples_a[i];
      const double b = picture.samples_b[i];
      const double difference = static_cast<double>(picture.half_a[channel * pixels + i]) -
                                static_cast<double>(picture.half_b[channel * pixels + i]);
      variance[i] = known[i] > 0 ? difference * difference * a * b / ((a + b) * (a + b)) : 0.0;
    }
    box_sum_2d(variance, picture.data);
    for (std::size_t i = 0; i < pixels; ++i) {
      out[channel * pixels + i] =
          weight[i] > 0 ? static_cast<float>(std::sqrt(std::max(variance[i], 0.0) / weight[i])) : 0.0f;
    }
  }
  return out;
}

Image to_image(const FilmPicture& picture) {
  Image image;
  image.display = picture.display;
  image.data = picture.data;
  image.attributes = receipt_attributes(picture.receipt);
  image.attributes.insert(picture.attributes.begin(), picture.attributes.end());
  const std::size_t pixels = picture.pixels();
  add_rgb(image, "", picture.beauty, pixels);
  add_rgb(image, "A.", picture.half_a, pixels);
  add_rgb(image, "B.", picture.half_b, pixels);
  add_rgb(image, "StdErr.", smoothed_standard_error(picture), pixels);
  std::vector<std::uint32_t> samples(pixels);
  std::ranges::transform(picture.samples_a, picture.samples_b, samples.begin(), std::plus<>());
  image.channels.push_back({"samples", std::move(samples)});
  image.channels.push_back({"A.samples", picture.samples_a});
  image.channels.push_back({"B.samples", picture.samples_b});
  std::vector<std::string> names;
  for (const PictureLayer& layer : picture.layers) {
    names.push_back(layer.name);
    for (std::size_t i = 0; i < layer.channels.size(); ++i) {
      const auto first = layer.values.begin() + static_cast<std::ptrdiff_t>(i * pixels);
      image.channels.push_back(
          {layer.channels[i], std::vector<float>(first, first + static_cast<std::ptrdiff_t>(pixels))});
    }
  }
  if (!picture.denoised.empty()) {
    add_rgb(image, kDenoisedPrefix, picture.denoised, pixels);
    image.attributes["lightmill.denoised"] =
        "first-order feature regression of R, G, B, mixed with the raw picture; its error is not known";
  }
  if (!names.empty()) {
    image.attributes[kLayersAttribute] = fmt::format("{}", fmt::join(names, " "));
  }
  image.attributes[kFileChecksum] = file_checksum(image);
  return image;
}

Result<FilmPicture> from_image(const Image& image) {
  FilmPicture picture(image.display, image.data);
  LM_RETURN_IF_ERROR(take_rgb(image, "", picture.beauty));
  LM_RETURN_IF_ERROR(take_rgb(image, "A.", picture.half_a));
  LM_RETURN_IF_ERROR(take_rgb(image, "B.", picture.half_b));
  LM_RETURN_IF_ERROR(take_counts(image, "A.samples", picture.samples_a));
  LM_RETURN_IF_ERROR(take_counts(image, "B.samples", picture.samples_b));
  picture.receipt = read_receipt(image);
  for (const auto& [name, attribute] : image.attributes) {
    const bool written_anew = name == kFileChecksum || name == kLayersAttribute || name == "lightmill.denoised";
    if (!written_anew && !is_of_openexr(name)) {
      picture.attributes[name] = attribute;
    }
  }
  for (const std::string& name : split_words(image.text(kLayersAttribute))) {
    LM_RETURN_IF_ERROR(take_layer(image, name, picture));
  }
  if (!image.text("lightmill.denoised").empty()) {
    LM_RETURN_IF_ERROR(take_rgb(image, kDenoisedPrefix, picture.denoised));
  }
  return picture;
}

RgbImage cropped_frame(const FilmPicture& picture) {
  return {picture.data.width, picture.data.height, picture.beauty};
}

RgbImage shown_frame(const FilmPicture& picture) {
  return {picture.data.width, picture.data.height, picture.denoised.empty() ? picture.beauty : picture.denoised};
}

Result<RgbImage> layer_frame(const FilmPicture& picture, std::string_view layer) {
  const auto found = std::ranges::find(picture.layers, layer, &PictureLayer::name);
  if (found == picture.layers.end() || !is_shown_layer(layer)) {
    std::vector<std::string> names;
    for (const PictureLayer& other : picture.layers) {
      if (is_shown_layer(other.name)) {
        names.push_back(other.name);
      }
    }
    return invalid_argument("the picture has no layer \"{}\" that can be shown. Layers that can be shown: {}", layer,
                            names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", ")));
  }
  RgbImage frame{picture.data.width, picture.data.height, found->values};
  if (layer == "normal") {
    std::ranges::transform(frame.values, frame.values.begin(), [](float n) { return srgb_decode(0.5f + 0.5f * n); });
  } else if (layer == "depth") {
    const float nearest = std::ranges::min(frame.values);
    std::ranges::transform(frame.values, frame.values.begin(),
                           [nearest](float depth) { return depth == kNoDepth ? 0.0f : nearest / depth; });
    const std::vector<float> grey = frame.values;
    for (int copy = 0; copy < 2; ++copy) {
      frame.values.insert(frame.values.end(), grey.begin(), grey.end());
    }
  }
  return frame;
}

}  // namespace lightmill

#include "common/image/read/opened_image.h"

#include <OpenImageIO/strutil.h>

#include <algorithm>
#include <cmath>

#include "common/base/text.h"
#include "common/image/exr.h"
#include "common/image/read/image_format.h"
#include "common/image/texels.h"

namespace lightmill {
namespace {

/// Pixels that are read at once. They stay in the processor's cache until they are taken.
constexpr std::size_t kBandBytes = std::size_t{1} << 20;

/// A file in memory whose beginning is replaced.
class ReplacedBeginning : public OIIO::Filesystem::IOProxy {
 public:
  ReplacedBeginning(std::string beginning, ByteView rest)
      : IOProxy("", Read), beginning_(std::move(beginning)), rest_(rest) {}
  const char* proxytype() const override { return "replaced beginning"; }
  std::size_t size() const override { return beginning_.size() + rest_.size(); }
  std::size_t read(void* out, std::size_t count) override {
    const std::size_t got = pread(out, count, m_pos);
    m_pos += static_cast<std::int64_t>(got);
    return got;
  }
  std::size_t pread(void* out, std::size_t count, std::int64_t offset) override {
    const auto at = static_cast<std::size_t>(std::clamp<std::int64_t>(offset, 0, static_cast<std::int64_t>(size())));
    const std::size_t skipped = std::min(at, beginning_.size());
    const std::size_t first = beginning_.copy(static_cast<char*>(out), count, skipped);
    const ByteView left = rest_.subspan(at - skipped);
    const std::size_t second = std::min(count - first, left.size());
    std::copy_n(left.begin(), second, static_cast<std::byte*>(out) + first);
    return first + second;
  }

 private:
  const std::string beginning_;
  const ByteView rest_;
};

/// Fills the other channels of pixels that have only `channels` values. Grey is copied. A missing alpha is `opaque`.
template <class T>
void complete(T* pixels, std::size_t count, int channels, T opaque) {
  for (T* pixel = pixels; channels < 4 && pixel != pixels + 4 * count; pixel += 4) {
    const T alpha = channels == 2 ? pixel[1] : opaque;
    if (channels < 3) {
      pixel[1] = pixel[2] = pixel[0];
    }
    pixel[3] = alpha;
  }
}

/// ": " and the first line of the library's message, if any. Further lines come from callers of the failed function.
std::string reason(const std::string& text) {
  const std::string line = library_text(text.substr(0, text.find('\n')));
  return line.empty() ? "" : ": " + line;
}

std::uint64_t pixels_of(const ImageWindow& window) {
  return static_cast<std::uint64_t>(window.pixel_count());
}

std::size_t index(int x, int y, int width) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
}

}  // namespace

Result<std::unique_ptr<OpenedImage>> OpenedImage::open(ByteView bytes) {
  const std::string format = image_format(bytes);
  if (format.empty()) {
    return invalid_argument("not a readable image: its first bytes match none of the formats {}", kImageFormats);
  }
  std::unique_ptr<OpenedImage> image(new OpenedImage(bytes));
  LM_RETURN_IF_ERROR(image->open_as(format));
  LM_RETURN_IF_ERROR(image->place());
  LM_RETURN_IF_ERROR(image->set_colors());
  return image;
}

Status OpenedImage::open_as(const std::string& format) {
  if (is_exr(bytes_)) {
    LM_RETURN_IF_ERROR(exr_header_end(bytes_).status());
  }
  if (format == "hdr") {
    LM_ASSIGN_OR_RETURN(radiance_, read_radiance_header(bytes_));
    source_ = std::make_unique<ReplacedBeginning>(radiance_->plain(), bytes_.subspan(radiance_->end));
  } else {
    source_ = std::make_unique<OIIO::Filesystem::IOMemReader>(bytes_.data(), bytes_.size());
  }
  OIIO::Filesystem::IOProxy* proxy = source_.get();
  OIIO::ImageSpec config, spec;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  config.attribute("oiio:UnassociatedAlpha", 1);  // otherwise colours are multiplied by alpha
  input_ = OIIO::ImageInput::create(format);
  if (input_ == nullptr) {
    return internal_error("OpenImageIO has no reader of {}{}", format, reason(OIIO::geterror()));
  }
  input_->set_ioproxy(proxy);
  if (!input_->open("image", spec, config)) {
    return invalid_argument("not a readable image (is it whole?){}", reason(input_->geterror()));
  }
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep) {
    return invalid_argument("a flat image of at least one pixel and channel is expected");
  }
  if (spec.get_string_attribute("textureformat").find("CubeFace") != std::string::npos) {
    return invalid_argument(
        "a cube map cannot be read. Save it as one image, for an environment with equal longitudes "
        "and latitudes");
  }
  return ok_status();
}

/// Finds the frame, and the file's part of it. Only EXR files can have another part than the whole.
Status OpenedImage::place() {
  constexpr std::int64_t kMaxPixels = std::int64_t{1} << 40;  // sizes in bytes fit 64 bits
  constexpr std::int64_t kFarthest = 1 << 30;                 // and differences of coordinates 32 bits
  const OIIO::ImageSpec& spec = input_->spec();
  frame_ = stored_ = {0, 0, spec.width, spec.height};
  std::int64_t x = 0, y = 0;
  if (radiance_) {
    frame_ = {0, 0, radiance_->width(), radiance_->height()};
  } else if (is_exr(bytes_)) {
    frame_ = {0, 0, spec.full_width, spec.full_height};
    x = std::int64_t{spec.x} - spec.full_x;
    y = std::int64_t{spec.y} - spec.full_y;
  }
  if (frame_.width < 1 || frame_.height < 1 || frame_.pixel_count() > kMaxPixels ||
      std::max(std::abs(x), std::abs(y)) > kFarthest) {
    return invalid_argument("a frame of {}x{} pixels with the data at ({}, {}) cannot be read", frame_.width,
                            frame_.height, x, y);
  }
  stored_.x = static_cast<int>(x);
  stored_.y = static_cast<int>(y);
  return ok_status();
}

/// Finds the conversion of colours to linear Rec. 709.
Status OpenedImage::set_colors() {
  std::optional<Primaries> primaries;
  if (radiance_) {
    primaries = radiance_->xyz ? kXyzPrimaries : radiance_->primaries;
  } else if (const OIIO::ParamValue* xy =
                 input_->spec().find_attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8));
             is_exr(bytes_) && xy != nullptr && input_->spec().nchannels >= 3) {
    const auto* const v = static_cast<const float*>(xy->data());
    primaries = {{v[0], v[1]}, {v[2], v[3]}, {v[4], v[5]}, {v[6], v[7]}};
  }
  if (primaries) {
    LM_ASSIGN_OR_RETURN(to_linear_, matrix_to_rec709(*primaries));
  }
  if (radiance_ && radiance_->exposure != std::array<double, 3>{1, 1, 1}) {
    const auto& [r, g, b] = radiance_->exposure;
    to_linear_ = to_linear_.value_or(glm::dmat3(1)) * glm::dmat3(1 / r, 0, 0, 0, 1 / g, 0, 0, 0, 1 / b);
  }
  return ok_status();
}

bool OpenedImage::half() const {
  const OIIO::ImageSpec& spec = input_->spec();
  return spec.format == OIIO::TypeDesc::HALF && spec.channelformats.empty() && !to_linear_;
}

ImageSize OpenedImage::size() const {
  const OIIO::TypeDesc type = input_->spec().format;
  const bool words = half() || type == OIIO::TypeDesc::UINT16;
  return {frame_.width, frame_.height, type.basesize() == 1 ? 4u : words ? 8u : 16u, ignored()};
}

IgnoredProperties OpenedImage::ignored() const {
  constexpr float kGamma = 2.2f, kMax = 0.05f;  // sRGB's, as files state it
  const OIIO::ImageSpec& spec = input_->spec();
  const bool linear = OIIO::Strutil::iequals(spec.get_string_attribute("oiio:ColorSpace"), "linear");
  const float gamma = linear ? 1 : spec.get_float_attribute("oiio:Gamma", kGamma);
  const bool has_profile = spec.find_attribute("ICCProfile") != nullptr;
  const std::string profile = spec.get_string_attribute("ICCProfile:profile_description");
  return {!radiance_ && spec.get_int_attribute("Orientation", 1) != 1, encoded() && std::abs(gamma - kGamma) > kMax,
          has_profile && profile.find("sRGB") == std::string::npos};
}

Status OpenedImage::check_limit(std::int64_t max_pixels) const {
  LM_RETURN_IF_ERROR(check_pixels(frame_.width, frame_.height, max_pixels));
  return check_pixels(stored_.width, stored_.height, max_pixels);
}

std::uint64_t OpenedImage::most_pixels() const {
  return std::max(pixels_of(frame_), pixels_of(stored_));
}

/// The pixels of the image, from those of the file.
template <class T>
std::vector<T> OpenedImage::moved(const std::vector<T>& stored) const {
  std::vector<T> pixels(4 * pixels_of(frame_));
  for (int y = 0; y < frame_.height; ++y) {
    for (int x = 0; x < frame_.width; ++x) {
      const int column = x - stored_.x, row = y - stored_.y;
      if (radiance_ || (column >= 0 && column < stored_.width && row >= 0 && row < stored_.height)) {
        const std::size_t from = radiance_ ? radiance_->pixel_at(x, y) : index(column, row, stored_.width);
        std::copy_n(stored.data() + 4 * from, 4, pixels.data() + 4 * index(x, y, frame_.width));
      }
    }
  }
  return pixels;
}

template <class T>
Status OpenedImage::read_as(OIIO::TypeDesc type, T opaque, const PixelSink& sink) {
  const OIIO::ImageSpec& spec = input_->spec();
  const int channels = std::min(spec.nchannels, 4);
  const bool in_place =
      radiance_ ? !(radiance_->columns || radiance_->upwards || radiance_->leftwards)
                : stored_.x == 0 && stored_.y == 0 && stored_.width == frame_.width && stored_.height == frame_.height;
  const std::size_t row = 4 * static_cast<std::size_t>(stored_.width);
  const bool in_bands = in_place && spec.tile_width == 0;
  const int band =
      in_bands ? static_cast<int>(std::max<std::size_t>(kBandBytes / (row * sizeof(T)), 1)) : stored_.height;
  std::vector<T> pixels;
  for (int begin = 0; begin < stored_.height; begin += band) {
    const int end = std::min(begin + band, stored_.height);
    pixels.resize(static_cast<std::size_t>(end - begin) * row);
    const auto stride = static_cast<OIIO::stride_t>(row * sizeof(T));
    if (!(in_bands ? input_->read_scanlines(0, 0, spec.y + begin, spec.y + end, spec.z, 0, channels, type,
                                            pixels.data(), 4 * sizeof(T), stride)
                   : input_->read_image(0, 0, 0, channels, type, pixels.data(), 4 * sizeof(T), stride))) {
      return invalid_argument("the image is damaged: not all of its pixels can be read{}. Save it again",
                              reason(input_->geterror()));
    }
    complete(pixels.data(), pixels.size() / 4, channels, opaque);
    if (!in_place) {
      pixels = moved(pixels);
    }
    convert(pixels);
    LM_RETURN_IF_ERROR(sink(std::as_bytes(std::span(pixels))));
  }
  return ok_status();
}

void OpenedImage::convert(std::vector<float>& pixels) const {
  for (std::size_t i = 0; to_linear_ && i < pixels.size(); i += 4) {
    const glm::dvec3 linear = *to_linear_ * glm::dvec3(pixels[i], pixels[i + 1], pixels[i + 2]);
    for (int channel = 0; channel < 3; ++channel) {
      pixels[i + static_cast<std::size_t>(channel)] = static_cast<float>(linear[channel]);
    }
  }
}

Status OpenedImage::read(const PixelSink& sink) {
  constexpr std::uint16_t kHalfOfOne = 0x3c00, kMostOfWord = 0xffff;
  switch (size().bytes_per_pixel) {
    case 4:
      return read_as<std::uint8_t>(OIIO::TypeDesc::UINT8, 255, sink);
    case 8:
      return half() ? read_as<std::uint16_t>(OIIO::TypeDesc::HALF, kHalfOfOne, sink)
                    : read_as<std::uint16_t>(OIIO::TypeDesc::UINT16, kMostOfWord, sink);
    default:
      return read_as<float>(OIIO::TypeDesc::FLOAT, 1.0f, sink);
  }
}

}  // namespace lightmill

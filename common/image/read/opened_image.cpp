#include "common/image/read/opened_image.h"

#include "common/base/library_text.h"
#include "common/image/exr_header.h"
#include "common/image/read/image_format.h"

namespace lightmill {
namespace {

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

/// ": " and the library's message, if any.
std::string reason(const std::string& text) {
  const std::string line = library_text(text);
  return line.empty() ? "" : ": " + line;
}

}  // namespace

OpenedImage::OpenedImage(ByteView bytes) : source_(const_cast<std::byte*>(bytes.data()), bytes.size()) {}

Result<std::unique_ptr<OpenedImage>> OpenedImage::open(ByteView bytes) {
  const std::string format = image_format(bytes);
  if (format.empty()) {
    return invalid_argument("not a readable image: its first bytes match none of the formats {}", kImageFormats);
  }
  if (is_exr(bytes)) {
    LM_RETURN_IF_ERROR(exr_header_end(bytes).status());
  }
  std::unique_ptr<OpenedImage> image(new OpenedImage(bytes));
  OIIO::Filesystem::IOProxy* proxy = &image->source_;
  OIIO::ImageSpec config, spec;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
  config.attribute("oiio:UnassociatedAlpha", 1);  // otherwise colours are multiplied by alpha
  image->input_ = OIIO::ImageInput::create(format);
  if (image->input_ == nullptr) {
    return internal_error("OpenImageIO has no reader of {}{}", format, reason(OIIO::geterror()));
  }
  image->input_->set_ioproxy(proxy);
  if (!image->input_->open("image", spec, config)) {
    return invalid_argument("not a readable image (is it whole?){}", reason(image->input_->geterror()));
  }
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.nchannels < 1 || spec.deep) {
    return invalid_argument("a flat image of at least one pixel and channel is expected");
  }
  return image;
}

ImageSize OpenedImage::size() const {
  return {static_cast<std::uint64_t>(width()) * static_cast<std::uint64_t>(height()),
          input_->spec().format.basesize() == 1 ? 4u : 16u};
}

template <class T>
Status OpenedImage::read_as(T* pixels, T opaque) {
  const int channels = std::min(input_->spec().nchannels, 4);
  if (!input_->read_image(0, 0, 0, channels, OIIO::BaseTypeFromC<T>::value, pixels, 4 * sizeof(T))) {
    return invalid_argument("the image is damaged, not all of its pixels can be read; save it again{}",
                            reason(input_->geterror()));
  }
  complete(pixels, size().pixels, channels, opaque);
  return ok_status();
}

Status OpenedImage::read(std::byte* pixels) {
  return size().bytes_per_pixel == 4 ? read_as<std::uint8_t>(reinterpret_cast<std::uint8_t*>(pixels), 255)
                                     : read_as<float>(reinterpret_cast<float*>(pixels), 1.0f);
}

}  // namespace lightmill

// Image file in memory, opened by OpenImageIO with its header read.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <memory>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image_size.h"

namespace lightmill {

/// Only the reader of the detected format sees the bytes. No reader gets a file name, because some would open it.
/// Messages do not name the image.
class OpenedImage {
 public:
  /// `bytes` must outlive the result. INVALID_ARGUMENT unless it is a flat image in one of kImageFormats.
  static Result<std::unique_ptr<OpenedImage>> open(ByteView bytes);

  int width() const { return input_->spec().width; }
  int height() const { return input_->spec().height; }
  ImageSize size() const;
  /// Integer values, which are sRGB-encoded unless the scene says otherwise.
  bool encoded() const { return !input_->spec().format.is_floating_point(); }
  /// Fills `pixels` in the layout of Texels: words if size() says 4 bytes per pixel, else four floats per pixel.
  Status read(std::byte* pixels);

 private:
  explicit OpenedImage(ByteView bytes);
  template <class T>
  Status read_as(T* pixels, T opaque);

  OIIO::Filesystem::IOMemReader source_;
  std::unique_ptr<OIIO::ImageInput> input_;
};

}  // namespace lightmill

// An image file in memory whose header is read, by OpenImageIO.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstddef>
#include <memory>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image_size.h"

namespace lightmill {

/// No reader but that of the format that the bytes begin like sees them. No reader sees a name of a file: some would
/// open it. Messages do not name the image.
class OpenedImage {
 public:
  /// `bytes` outlive the result. INVALID_ARGUMENT for what is no flat image of one of kImageFormats.
  static Result<std::unique_ptr<OpenedImage>> open(ByteView bytes);

  int width() const { return input_->spec().width; }
  int height() const { return input_->spec().height; }
  ImageSize size() const;
  /// Integers, which are sRGB-encoded unless the scene says otherwise.
  bool encoded() const { return !input_->spec().format.is_floating_point(); }
  /// Fills `pixels` as Texels has them: words if size() says 4 bytes a pixel, else four floats a pixel.
  Status read(std::byte* pixels);

 private:
  explicit OpenedImage(ByteView bytes);
  template <class T>
  Status read_as(T* pixels, T opaque);

  OIIO::Filesystem::IOMemReader source_;
  std::unique_ptr<OIIO::ImageInput> input_;
};

}  // namespace lightmill

// Image file in memory, opened by OpenImageIO with its header read.
#pragma once

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <functional>
#include <memory>
#include <optional>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/image.h"
#include "common/image/image_size.h"
#include "common/image/read/radiance_header.h"

namespace lightmill {

/// Takes the next rows of pixels.
using PixelSink = std::function<Status(ByteView rows)>;

/// Only the reader of the detected format sees the bytes. No reader gets a file name, because some would open it.
/// Messages do not name the image. The reader applies the windows and primaries of EXR files, and the orientation,
/// exposure and colour space of Radiance pictures.
class OpenedImage {
 public:
  /// `bytes` must outlive the result. INVALID_ARGUMENT unless it is a flat image in one of kImageFormats.
  static Result<std::unique_ptr<OpenedImage>> open(ByteView bytes);

  int width() const { return frame_.width; }
  int height() const { return frame_.height; }
  ImageSize size() const;
  /// RESOURCE_EXHAUSTED if the image, or the part that the file stores, has more pixels.
  Status check_limit(std::int64_t max_pixels) const;
  /// Pixels of the image, or of the part that the file stores, if that has more.
  std::uint64_t most_pixels() const;
  /// Integer values, which are sRGB-encoded unless the scene says otherwise.
  bool encoded() const { return !input_->spec().format.is_floating_point(); }
  /// Values of half floats, which need no conversion.
  bool half() const;
  /// Gives all pixels from the top in the layout of Texels, with as many bytes per pixel as size() says. They are zero
  /// where the file has none. Most files are read in bands, which stay in the processor's cache. Stops at an error of
  /// `sink`.
  Status read(const PixelSink& sink);

 private:
  explicit OpenedImage(ByteView bytes) : bytes_(bytes) {}
  Status open_as(const std::string& format);
  Status place();
  IgnoredProperties ignored() const;
  Status set_colors();
  /// `type`: of T, or of half floats if these are words.
  template <class T>
  Status read_as(OIIO::TypeDesc type, T opaque, const PixelSink& sink);
  template <class T>
  std::vector<T> moved(const std::vector<T>& stored) const;
  void convert(std::vector<float>& pixels) const;
  template <class Integer>
  void convert(const std::vector<Integer>&) const {}

  ByteView bytes_;
  std::unique_ptr<OIIO::Filesystem::IOProxy> source_;
  std::unique_ptr<OIIO::ImageInput> input_;
  ImageWindow frame_;                       ///< the image; at (0, 0)
  ImageWindow stored_;                      ///< the pixels of the file. They may lie partly outside of the frame
  std::optional<RadianceHeader> radiance_;  ///< its pixels are in the order of the file
  std::optional<glm::dmat3> to_linear_;     ///< of colours as they are in the file, to Rec. 709
};

}  // namespace lightmill

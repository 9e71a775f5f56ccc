#include "common/image/picture_file.h"

#include <algorithm>
#include <cctype>

#include "common/base/file.h"
#include "common/image/exr.h"
#include "common/image/png.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

Result<RgbImage> rgb_of_exr(ByteView bytes) {
  LM_ASSIGN_OR_RETURN(const Image image, decode_exr(bytes));
  RgbImage rgb{image.data.width, image.data.height, {}};
  for (const char* name : {"R", "G", "B"}) {
    const std::vector<float>* values = image.floats(name);
    if (values == nullptr) {
      return invalid_argument("the file has no channel {}", name);
    }
    rgb.values.insert(rgb.values.end(), values->begin(), values->end());
  }
  return rgb;
}

}  // namespace

Result<PictureFormat> picture_format(const fs::path& path) {
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  if (extension == ".exr") {
    return PictureFormat::exr;
  }
  if (extension == ".png") {
    return PictureFormat::png;
  }
  return invalid_argument("{}: a picture's name must end in .exr or .png", path.string());
}

Result<std::string> encode_picture(const FilmPicture& picture, PictureFormat format, const ViewSettings& view,
                                   std::string_view png_layer) {
  if (format == PictureFormat::exr) {
    return encode_exr(to_image(picture));
  }
  LM_ASSIGN_OR_RETURN(const RgbImage frame, png_layer.empty() ? shown_frame(picture) : layer_frame(picture, png_layer));
  return encode_png(frame.width, frame.height, to_srgb8(frame, view));
}

Result<RgbImage> load_rgb(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const PictureFormat format, picture_format(path));
  LM_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  return with_context(format == PictureFormat::exr ? rgb_of_exr(as_byte_view(bytes)) : decode_png(as_byte_view(bytes)),
                      path.string());
}

Result<FilmPicture> load_film_picture(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  LM_ASSIGN_OR_RETURN(const Image image, with_context(decode_exr(as_byte_view(bytes)), path.string()));
  LM_ASSIGN_OR_RETURN(FilmPicture picture, with_context(from_image(image), path.string()));
  return picture;
}

}  // namespace lightmill

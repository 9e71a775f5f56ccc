#include "common/image/picture_file.h"

#include <algorithm>
#include <cctype>
#include <glm/glm.hpp>

#include "common/base/file.h"
#include "common/image/exr.h"
#include "common/image/png.h"

namespace lightmill {
namespace fs = std::filesystem;
namespace {

Result<FramedPicture> framed_exr(ByteView bytes) {
  LM_ASSIGN_OR_RETURN(const Image image, decode_exr(bytes));
  return framed_picture(image);
}

Result<FramedPicture> framed_png(ByteView bytes) {
  LM_ASSIGN_OR_RETURN(RgbImage rgb, decode_png(bytes));
  const ImageWindow frame{0, 0, rgb.width, rgb.height};
  return FramedPicture{std::move(rgb), frame, frame};
}

void convert_colors(const glm::dmat3& matrix, RgbImage& image) {
  const std::size_t pixels = image.pixels();
  for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
    float* const at = image.values.data() + pixel;
    const glm::dvec3 color = matrix * glm::dvec3(at[0], at[pixels], at[2 * pixels]);
    at[0] = static_cast<float>(color.x);
    at[pixels] = static_cast<float>(color.y);
    at[2 * pixels] = static_cast<float>(color.z);
  }
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

Result<FramedPicture> framed_picture(const Image& image) {
  FramedPicture picture{{image.data.width, image.data.height, {}}, image.display, image.data};
  const std::vector<float>* const grey = image.floats("R") == nullptr ? image.floats("Y") : nullptr;
  for (const char* name : {"R", "G", "B"}) {
    const std::vector<float>* const values = grey != nullptr ? grey : image.floats(name);
    if (values == nullptr) {
      return invalid_argument("the file has no channel {}", name);
    }
    picture.rgb.values.insert(picture.rgb.values.end(), values->begin(), values->end());
  }
  if (image.primaries && grey == nullptr) {
    LM_ASSIGN_OR_RETURN(const std::optional<glm::dmat3> to_rec709, matrix_to_rec709(*image.primaries));
    if (to_rec709) {
      convert_colors(*to_rec709, picture.rgb);
    }
  }
  return picture;
}

Result<FramedPicture> load_framed(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const PictureFormat format, picture_format(path));
  LM_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  return with_context(format == PictureFormat::exr ? framed_exr(as_byte_view(bytes)) : framed_png(as_byte_view(bytes)),
                      path.string());
}

Result<RgbImage> load_rgb(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(FramedPicture picture, load_framed(path));
  return std::move(picture.rgb);
}

bool cut_to(const ImageWindow& crop, const ImageWindow& frame, FramedPicture& whole) {
  const ImageWindow& from = whole.data;
  const bool inside = crop.x >= from.x && crop.y >= from.y && crop.x + crop.width <= from.x + from.width &&
                      crop.y + crop.height <= from.y + from.height;
  if (whole.display != frame || from == crop || !inside) {
    return false;
  }
  RgbImage part{crop.width, crop.height, {}};
  part.values.reserve(3 * part.pixels());
  for (std::size_t channel = 0; channel < 3; ++channel) {
    for (int y = 0; y < crop.height; ++y) {
      const auto row =
          whole.rgb.values.begin() + static_cast<std::ptrdiff_t>(channel * whole.rgb.pixels() +
                                                                 static_cast<std::size_t>(crop.y - from.y + y) *
                                                                     static_cast<std::size_t>(from.width) +
                                                                 static_cast<std::size_t>(crop.x - from.x));
      part.values.insert(part.values.end(), row, row + crop.width);
    }
  }
  whole = {std::move(part), frame, crop};
  return true;
}

Result<FilmPicture> load_film_picture(const fs::path& path) {
  LM_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  LM_ASSIGN_OR_RETURN(const Image image, with_context(decode_exr(as_byte_view(bytes)), path.string()));
  LM_ASSIGN_OR_RETURN(FilmPicture picture, with_context(from_image(image), path.string()));
  return picture;
}

}  // namespace lightmill

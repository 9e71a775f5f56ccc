// Picture files. The extension states the format: .exr or .png.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/image/color.h"
#include "common/image/film_picture.h"
#include "common/image/image.h"

namespace lightmill {

enum class PictureFormat { exr, png };

/// By extension, upper or lower case. INVALID_ARGUMENT names the path and the two formats.
Result<PictureFormat> picture_format(const std::filesystem::path& path);

/// The file's bytes: EXR with all layers and the receipt, or PNG of the shown frame, or of `png_layer`, through `view`.
Result<std::string> encode_picture(const FilmPicture& picture, PictureFormat format, const ViewSettings& view,
                                   std::string_view png_layer = "");

/// Linear RGB of an EXR's `R G B` (its data window) or of a PNG. Errors name the path.
Result<RgbImage> load_rgb(const std::filesystem::path& path);

/// A film picture with its receipt from an EXR that Lightmill wrote. Errors name the path.
Result<FilmPicture> load_film_picture(const std::filesystem::path& path);

}  // namespace lightmill

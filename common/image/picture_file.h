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

/// A picture and its place in the frame that it may be a crop of. PNG files are whole frames.
struct FramedPicture {
  RgbImage rgb;
  ImageWindow display, data;
};
/// Linear RGB (Rec. 709) of the channels `R G B` of an EXR (its data window), or of `Y` if it has no `R`. INVALID_ARGUMENT
/// if one is missing.
Result<FramedPicture> framed_picture(const Image& image);
/// The same of a file, or the pixels of a PNG. Errors name the path.
Result<FramedPicture> load_framed(const std::filesystem::path& path);
Result<RgbImage> load_rgb(const std::filesystem::path& path);

/// Cuts `whole` to the window of `crop`. Does nothing unless both have the same frame, and the window is a part of it
/// that `whole` has. Returns whether it was cut.
bool cut_to(const ImageWindow& crop, const ImageWindow& frame, FramedPicture& whole);

/// A film picture with its receipt from an EXR that Lightmill wrote. Errors name the path.
Result<FilmPicture> load_film_picture(const std::filesystem::path& path);

}  // namespace lightmill

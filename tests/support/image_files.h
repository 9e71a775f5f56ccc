// Small image files of each format, for tests of the readers.
#pragma once

#include <string>
#include <vector>

namespace lightmill::test {

struct ImageFile {
  std::string format;  ///< the ending of its name
  std::string bytes;
};

/// 16×16 pixels in each format that scenes can use (kImageFormats). EXR and TIFF come with each compression.
std::vector<ImageFile> readable_image_files();

/// Formats that are refused: those that OpenImageIO reads only from files or through names in an image, and unknown
/// ones.
std::vector<ImageFile> refused_image_files();

/// An image of one value, written by OpenImageIO. `compression` is OpenImageIO's name.
std::string image_file(const std::string& format, float value, const std::string& compression = "");

/// The same with 16 bits per channel: half floats in EXR files, else integers.
std::string image_file_of_words(const std::string& format, float value);

}  // namespace lightmill::test

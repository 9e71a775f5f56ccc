// A small image file of each format, for tests of what reads them.
#pragma once

#include <string>
#include <vector>

namespace lightmill::test {

struct ImageFile {
  std::string format;  ///< the ending of its name
  std::string bytes;
};

/// Of each format that scenes may have (kImageFormats), 16×16 pixels; of EXR and TIFF, each way to compress.
std::vector<ImageFile> readable_image_files();

/// Of formats that OpenImageIO reads, but from files only or from what an image names; and of none.
std::vector<ImageFile> refused_image_files();

/// As written by OpenImageIO, of one colour; the compression has OpenImageIO's name.
std::string image_file(const std::string& format, float value, const std::string& compression = "");

}  // namespace lightmill::test

// Looks into image files by the code that workers decode them with.
//
// OpenImageIO takes some tenths of a second to start, so it is not linked into the command line: this is a library of
// its own, lightmill-images.so beside the program, which is loaded for scenes that have images (cli/image_check.h).
#pragma once

#include <cstdint>
#include <string>

#include "common/base/digest.h"

namespace lightmill {

struct ImageFacts {
  int width = 0, height = 0;          ///< pixels
  std::uint64_t negative_pixels = 0;  ///< with a colour value below 0
};

/// Decodes an image file; `name` ends as its format does. Fills `facts` and returns true, or `problem` (which begins
/// with the name) and returns false.
using InspectImage = bool(ByteView bytes, const std::string& name, ImageFacts& facts, std::string& problem);

inline constexpr const char* kInspectImageSymbol = "lightmill_inspect_image";
inline constexpr const char* kImageLibrary = "lightmill-images.so";

}  // namespace lightmill

#include "tests/support/image_files.h"

#include <OpenImageIO/imageio.h>

#include "common/base/check.h"
#include "common/base/file.h"
#include "common/image/exr.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

constexpr int kSide = 16;

std::string number(std::uint32_t value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

/// Three planes of 8 bits, uncompressed. OpenImageIO cannot write PSD.
std::string psd_file() {
  std::string file("8BPS\0\1\0\0\0\0\0\0\0\3\0\0\0\x10\0\0\0\x10\0\x08\0\3", 26);
  file += std::string(3 * 4, '\0') + std::string(2, '\0');
  return file + std::string(3 * kSide * kSide, '\x80');
}

/// 24 bits a pixel.
std::string dds_file() {
  std::string file = "DDS " + number(124) + number(0x1007) + number(kSide) + number(kSide);
  file += std::string(4 * 14, '\0') + number(32) + number(0x40) + number(0) + number(24) + number(0xff0000);
  file += number(0xff00) + number(0xff) + number(0) + number(0x1000) + std::string(16, '\0');
  return file + std::string(3 * kSide * kSide, '\x80');
}

/// The middle quarter of a frame.
std::string cropped_exr_file() {
  Image image;
  image.display = {0, 0, kSide, kSide};
  image.data = {kSide / 4, kSide / 4, kSide / 2, kSide / 2};
  for (const char* const name : {"R", "G", "B"}) {
    image.channels.push_back({name, std::vector<float>(kSide * kSide / 4, 0.5f)});
  }
  return encode_exr(image).value();
}

/// The first column of the file is the right one of the picture.
std::string turned_radiance_file() {
  std::string file = "#?RADIANCE\nEXPOSURE=2\nFORMAT=32-bit_rle_xyze\n\n-X 16 +Y 16\n";
  for (int i = 0; i < kSide * kSide; ++i) {
    file += std::string({static_cast<char>(i), '\x80', '\x70', '\x80'});
  }
  return file;
}

std::string pfm_file() {
  std::string file = "PF\n16 16\n-1.0\n";
  for (int i = 0; i < 3 * kSide * kSide; ++i) {
    file += std::string("\0\0\0\x3f", 4);  // 0.5
  }
  return file;
}

std::string written(const std::string& format, OIIO::TypeDesc type, float value, const std::string& compression) {
  const TemporaryFolder folder;
  const std::string path = (folder.path() / ("image." + format)).string();
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(path);
  LM_CHECK(output != nullptr, "{}", OIIO::geterror());
  OIIO::ImageSpec spec(kSide, kSide, 3, type);
  if (!compression.empty()) {
    spec.attribute("compression", compression);
  }
  const std::vector<float> pixels(3 * kSide * kSide, value);
  LM_CHECK(output->open(path, spec) && output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) && output->close(),
           "{}", output->geterror());
  return read_file(path).value();
}

}  // namespace

std::string image_file(const std::string& format, float value, const std::string& compression) {
  const bool is_float = format == "exr" || format == "hdr";
  return written(format, is_float ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8, value, compression);
}

std::string image_file_of_words(const std::string& format, float value) {
  return written(format, format == "exr" ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::UINT16, value, "");
}

std::vector<ImageFile> readable_image_files() {
  std::vector<ImageFile> files{{"psd", psd_file()}, {"dds", dds_file()}, {"pfm", pfm_file()}};
  for (const char* format : {"png", "jpg", "exr", "tif", "tga", "bmp", "gif", "webp", "ppm", "hdr"}) {
    files.push_back({format, image_file(format, 0.5f)});
  }
  for (const char* format : {"png", "tif", "exr"}) {
    files.push_back({format, image_file_of_words(format, 0.5f)});
  }
  files.push_back({"hdr", turned_radiance_file()});
  files.push_back({"exr", cropped_exr_file()});
  for (const char* compression : {"none", "rle", "zips", "piz", "pxr24", "b44", "b44a", "dwaa", "dwab"}) {
    files.push_back({"exr", image_file("exr", 0.5f, compression)});
  }
  for (const char* compression : {"none", "lzw", "packbits", "jpeg"}) {
    files.push_back({"tif", image_file("tif", 0.5f, compression)});
  }
  return files;
}

std::vector<ImageFile> refused_image_files() {
  std::vector<ImageFile> files{{"dcm", std::string(128, '\0') + "DICM" + std::string(64, '\0')},
                               {"mp4", std::string("\0\0\0\x18"
                                                   "ftypmp42\0\0\0\0mp42isom",
                                                   24)},
                               {"null", "any bytes"},
                               {"svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>"},
                               {"m3u8", "#EXTM3U\n#EXTINF:1,\nhttp://127.0.0.1/x.ts\n"}};
  for (const char* format : {"sgi", "fits", "rla", "ico", "dpx", "iff"}) {
    files.push_back({format, image_file(format, 0.5f)});
  }
  return files;
}

}  // namespace lightmill::test

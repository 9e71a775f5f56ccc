#include "common/image/read/image_format.h"

#include <array>
#include <string_view>

namespace lightmill {
namespace {

using namespace std::string_view_literals;

constexpr std::array<std::pair<std::string_view, std::string_view>, 13> kBeginnings{{{"\x89PNG"sv, "png"},
                                                                                     {"\xff\xd8\xff"sv, "jpeg"},
                                                                                     {"\x76\x2f\x31\x01"sv, "openexr"},
                                                                                     {"#?"sv, "hdr"},
                                                                                     {"II*\0"sv, "tiff"},
                                                                                     {"MM\0*"sv, "tiff"},
                                                                                     {"II+\0"sv, "tiff"},
                                                                                     {"MM\0+"sv, "tiff"},
                                                                                     {"GIF8"sv, "gif"},
                                                                                     {"BM"sv, "bmp"},
                                                                                     {"8BPS"sv, "psd"},
                                                                                     {"DDS "sv, "dds"},
                                                                                     {"RIFF"sv, "webp"}}};

bool is_one_of(char c, std::string_view characters) {
  return characters.find(c) != std::string_view::npos;
}

/// "P1" to "P6", "PF" or "Pf", then white space.
bool is_pnm(std::string_view text) {
  return text.size() > 2 && text[0] == 'P' && is_one_of(text[1], "123456Ff") && is_one_of(text[2], " \t\r\n");
}

/// TGA has no magic number, so this checks the fields of its 18-byte header.
bool is_tga(std::string_view text) {
  constexpr std::size_t kHeader = 18;
  if (text.size() < kHeader) {
    return false;
  }
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(text[at]); };
  const bool palette = byte(1) == 1, indexed = (byte(2) & 7) == 1;
  const bool known_type = byte(1) <= 1 && (byte(2) & ~8) >= 1 && (byte(2) & ~8) <= 3 && (palette || !indexed);
  const bool known_depth = is_one_of(text[16], "\x08\x0f\x10\x18\x20");
  return known_type && known_depth && (byte(12) | byte(13)) != 0 && (byte(14) | byte(15)) != 0 && byte(17) < 0x40;
}

}  // namespace

std::string image_format(ByteView bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const auto& [beginning, format] : kBeginnings) {
    if (text.starts_with(beginning) && (format != "webp" || text.substr(0, 12).ends_with("WEBP"))) {
      return std::string(format);
    }
  }
  return is_pnm(text) ? "pnm" : is_tga(text) ? "targa" : "";
}

}  // namespace lightmill

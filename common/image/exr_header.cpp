#include "common/image/exr_header.h"

#include <array>
#include <cstring>

namespace lightmill {
namespace {

constexpr std::size_t kFirstAttribute = 8;  // after the magic number and the version

}  // namespace

bool is_exr(ByteView bytes) {
  constexpr std::array<unsigned char, 4> kMagic{0x76, 0x2f, 0x31, 0x01};
  return bytes.size() >= kMagic.size() && std::memcmp(bytes.data(), kMagic.data(), kMagic.size()) == 0;
}

// Magic number and version, then attributes (name, type, both zero-terminated, size, value), then a zero.
Result<std::size_t> exr_header_end(ByteView bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.size() < kFirstAttribute || !is_exr(bytes)) {
    return invalid_argument("not a readable EXR file: it does not begin like one");
  }
  const bool several_parts = (static_cast<unsigned char>(text[5]) & 0x10) != 0;
  std::size_t at = kFirstAttribute;
  for (bool first_of_part = true; at < text.size();) {
    if (text[at] == '\0') {  // end of a part's header; an empty header ends the list of parts
      if (!several_parts || first_of_part) {
        return at + 1;
      }
      ++at;
      first_of_part = true;
      continue;
    }
    first_of_part = false;
    const std::size_t name_end = text.find('\0', at);
    const std::size_t type_end = name_end == text.npos ? text.npos : text.find('\0', name_end + 1);
    std::int32_t size = -1;
    if (type_end != text.npos && text.size() - type_end > sizeof(size)) {
      std::memcpy(&size, text.data() + type_end + 1, sizeof(size));
    }
    if (size < 0 || static_cast<std::size_t>(size) > text.size() - type_end - 1 - sizeof(size)) {
      return invalid_argument("not a readable EXR file: the attribute at byte {} does not lie within its {} bytes", at,
                              text.size());
    }
    at = type_end + 1 + sizeof(size) + static_cast<std::size_t>(size);
  }
  return invalid_argument("not a readable EXR file: its header has no end");
}

}  // namespace lightmill

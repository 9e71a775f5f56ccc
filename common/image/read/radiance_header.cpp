#include "common/image/read/radiance_header.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <string_view>
#include <vector>

#include "common/base/text.h"

namespace lightmill {
namespace {

/// Numbers that white space separates. Nothing if there is anything else, or not `count` of them.
std::optional<std::vector<double>> numbers(std::string_view text, std::size_t count) {
  std::vector<double> out;
  while (true) {
    text.remove_prefix(std::min(text.find_first_not_of(" \t\r"), text.size()));
    if (text.empty()) {
      return out.size() == count ? std::optional(out) : std::nullopt;
    }
    double value = 0;
    const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (code != std::errc() || !std::isfinite(value)) {
      return std::nullopt;
    }
    out.push_back(value);
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  }
}

/// "+X 64": where an axis points, and how many pixels it has.
struct Axis {
  char sign = 0, name = 0;
  int pixels = 0;
};

std::optional<Axis> take_axis(std::string_view& text) {
  text.remove_prefix(std::min(text.find_first_not_of(' '), text.size()));
  if (text.size() < 4 || (text[0] != '+' && text[0] != '-') || (text[1] != 'X' && text[1] != 'Y') || text[2] != ' ') {
    return std::nullopt;
  }
  Axis axis{text[0], text[1], 0};
  text.remove_prefix(std::min(text.find_first_not_of(' ', 2), text.size()));
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), axis.pixels);
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return code == std::errc() && axis.pixels > 0 ? std::optional(axis) : std::nullopt;
}

/// The line of the size, such as "-Y 32 +X 64". The first axis counts scanlines.
bool read_size(std::string_view line, RadianceHeader& header) {
  const std::optional<Axis> first = take_axis(line), second = take_axis(line);
  if (!first || !second || first->name == second->name) {
    return false;
  }
  header.columns = first->name == 'X';
  header.scanlines = first->pixels;
  header.length = second->pixels;
  header.upwards = (header.columns ? second : first)->sign == '+';
  header.leftwards = (header.columns ? first : second)->sign == '-';
  return true;
}

Status wrong(std::string_view line, std::string_view expected) {
  return invalid_argument("not a readable Radiance picture: {} is expected, got \"{}\"", expected,
                          printable(line.substr(0, 60)));
}

/// A line of the header, such as "EXPOSURE=0.5". Others have no effect on pixels.
Status read_line(std::string_view line, RadianceHeader& header) {
  const std::string_view name = line.substr(0, line.find('='));
  const std::string_view value = line.substr(std::min(name.size() + 1, line.size()));
  if (name == "EXPOSURE" || name == "COLORCORR") {
    const auto factors = numbers(value, name == "EXPOSURE" ? 1 : 3);
    for (std::size_t i = 0; i < 3; ++i) {
      header.exposure[i] *= factors ? (*factors)[i % factors->size()] : 0;
      if (!(header.exposure[i] > 1e-30 && header.exposure[i] < 1e30)) {
        return wrong(line, "a factor above 0");
      }
    }
  } else if (name == "FORMAT") {
    header.xyz = value == "32-bit_rle_xyze";
    if (!header.xyz && value != "32-bit_rle_rgbe") {
      return wrong(line, "FORMAT=32-bit_rle_rgbe or 32-bit_rle_xyze");
    }
  } else if (name == "GAMMA") {
    const auto gamma = numbers(value, 1);
    if (!gamma || gamma->front() != 1) {
      return wrong(line, "a picture with linear values (GAMMA=1)");
    }
  } else if (name == "PRIMARIES") {
    const auto p = numbers(value, 8);
    if (!p) {
      return wrong(line, "PRIMARIES= with eight numbers");
    }
    header.primaries = {{(*p)[0], (*p)[1]}, {(*p)[2], (*p)[3]}, {(*p)[4], (*p)[5]}, {(*p)[6], (*p)[7]}};
  }
  return ok_status();
}

}  // namespace

std::size_t RadianceHeader::pixel_at(int x, int y) const {
  const int across = leftwards ? width() - 1 - x : x, down = upwards ? height() - 1 - y : y;
  const auto scanline = static_cast<std::size_t>(columns ? across : down);
  return scanline * static_cast<std::size_t>(length) + static_cast<std::size_t>(columns ? down : across);
}

std::string RadianceHeader::plain() const {
  return fmt::format("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", scanlines, length);
}

Result<RadianceHeader> read_radiance_header(ByteView bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  RadianceHeader header;
  bool sized = false;
  for (bool empty = false; !sized;) {
    const std::size_t end = text.find('\n', header.end);
    if (end == std::string_view::npos) {
      return invalid_argument("not a readable Radiance picture: its header has no end");
    }
    std::string_view line = text.substr(header.end, end - header.end);
    header.end = end + 1;
    while (line.ends_with(' ') || line.ends_with('\r')) {
      line.remove_suffix(1);
    }
    if (empty) {
      sized = read_size(line, header);
      if (!sized) {
        return wrong(line, "a size such as -Y 512 +X 1024");
      }
    } else {
      LM_RETURN_IF_ERROR(read_line(line, header));
      empty = line.empty();
    }
  }
  return header;
}

}  // namespace lightmill

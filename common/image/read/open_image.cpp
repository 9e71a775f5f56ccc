#include "common/image/read/open_image.h"

#include <array>
#include <string_view>

#include "common/base/library_text.h"
#include "common/image/exr_header.h"

namespace lightmill {
namespace {

using namespace std::string_view_literals;

/// How files of formats begin.
constexpr std::array<std::pair<std::string_view, std::string_view>, 12> kBeginnings{{{"\x89PNG"sv, "png"},
                                                                                     {"\xff\xd8\xff"sv, "jpg"},
                                                                                     {"\x76\x2f\x31\x01"sv, "exr"},
                                                                                     {"#?"sv, "hdr"},
                                                                                     {"II*\0"sv, "tif"},
                                                                                     {"MM\0*"sv, "tif"},
                                                                                     {"II+\0"sv, "tif"},
                                                                                     {"MM\0+"sv, "tif"},
                                                                                     {"GIF8"sv, "gif"},
                                                                                     {"BM"sv, "bmp"},
                                                                                     {"DDS "sv, "dds"},
                                                                                     {"8BPS"sv, "psd"}}};

/// The ending of a file's name that tells its format; empty if nothing does.
std::string ending_of(ByteView bytes, const std::string& name) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  for (const auto& [beginning, ending] : kBeginnings) {
    if (text.starts_with(beginning)) {
      return std::string(ending);
    }
  }
  if (text.starts_with("RIFF") && text.substr(std::min<std::size_t>(8, text.size())).starts_with("WEBP")) {
    return "webp";
  }
  const std::size_t dot = name.rfind('.');
  return dot == std::string::npos ? "" : name.substr(dot + 1);
}

}  // namespace

Result<std::unique_ptr<OIIO::ImageInput>> open_image(ByteView bytes, const std::string& name,
                                                     OIIO::Filesystem::IOProxy& source, OIIO::ImageSpec config) {
  [[maybe_unused]] static const bool kOneReader = OIIO::attribute("try_all_readers", 0);
  if (is_exr(bytes)) {
    LM_RETURN_IF_ERROR(with_context(exr_header_end(bytes).status(), name));
  }
  const std::string ending = ending_of(bytes, name);
  if (ending.empty()) {
    return invalid_argument("{}: not a readable image: neither its first bytes nor its name tell its format", name);
  }
  OIIO::Filesystem::IOProxy* proxy = &source;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);  // a format with a configuration takes it from there
  const std::string file = name.ends_with("." + ending) ? name : fmt::format("{}.{}", name, ending);
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(file, &config, proxy);
  if (input == nullptr) {
    return invalid_argument("{}: not a readable image (is it whole?): {}", name, library_text(OIIO::geterror()));
  }
  return input;
}

}  // namespace lightmill

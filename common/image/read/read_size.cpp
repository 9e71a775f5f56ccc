#include "common/image/read/read_size.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "common/image/exr_header.h"

namespace lightmill {

Result<ImageSize> read_size(ByteView bytes, const std::string& name) {
  if (is_exr(bytes)) {  // whatever its name is
    LM_RETURN_IF_ERROR(with_context(exr_header_end(bytes).status(), name));
  }
  OIIO::Filesystem::IOMemReader reader(const_cast<std::byte*>(bytes.data()), bytes.size());
  OIIO::ImageSpec config;
  OIIO::Filesystem::IOProxy* proxy = &reader;
  config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);  // as read_image
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(name, &config, proxy);
  if (input == nullptr) {
    return invalid_argument("{}: not a readable image: {}", name, OIIO::geterror());
  }
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) {
    return invalid_argument("{}: an image of at least one pixel and channel is expected", name);
  }
  return ImageSize{static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height),
                   spec.format.basesize() == 1 ? 4u : 16u};
}

}  // namespace lightmill

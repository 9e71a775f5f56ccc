#include "common/image/read/read_size.h"

#include "common/image/read/open_image.h"

namespace lightmill {

Result<ImageSize> read_size(ByteView bytes, const std::string& name) {
  OIIO::Filesystem::IOMemReader reader(const_cast<std::byte*>(bytes.data()), bytes.size());
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<OIIO::ImageInput> input, open_image(bytes, name, reader));
  const OIIO::ImageSpec& spec = input->spec();
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1) {
    return invalid_argument("{}: an image of at least one pixel and channel is expected", name);
  }
  return ImageSize{static_cast<std::uint64_t>(spec.width) * static_cast<std::uint64_t>(spec.height),
                   spec.format.basesize() == 1 ? 4u : 16u};
}

}  // namespace lightmill

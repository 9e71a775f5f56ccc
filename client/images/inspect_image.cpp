#include "client/images/inspect_image.h"

#include "common/image/read/read_image.h"

extern "C" bool lightmill_inspect_image(lightmill::ByteView bytes, const std::string& name,
                                        lightmill::ImageFacts& facts, std::string& problem) {
  const lightmill::Result<lightmill::Texels> texels = lightmill::read_image(bytes, name);
  if (!texels.ok()) {
    problem = lightmill::message_of(texels.status());
    return false;
  }
  facts.width = texels->width;
  facts.height = texels->height;
  facts.negative_pixels = 0;
  for (std::size_t i = 0; i + 3 < texels->floats.size(); i += 4) {
    const float* rgb = &texels->floats[i];
    facts.negative_pixels += rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0 ? 1 : 0;
  }
  return true;
}

static_assert(std::is_same_v<decltype(lightmill_inspect_image), lightmill::InspectImage>);

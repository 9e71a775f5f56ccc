#include "common/image/image.h"

namespace lightmill {
namespace {

template <class T>
const std::vector<T>* find_channel(const Image& image, const std::string& name) {
  for (const ImageChannel& channel : image.channels) {
    if (channel.name == name) {
      return std::get_if<std::vector<T>>(&channel.values);
    }
  }
  return nullptr;
}

}  // namespace

const std::vector<float>* Image::floats(const std::string& name) const {
  return find_channel<float>(*this, name);
}

const std::vector<std::uint32_t>* Image::counts(const std::string& name) const {
  return find_channel<std::uint32_t>(*this, name);
}

std::string Image::text(const std::string& name) const {
  const auto found = attributes.find(name);
  const std::string* text = found == attributes.end() ? nullptr : std::get_if<std::string>(&found->second);
  return text == nullptr ? "" : *text;
}

}  // namespace lightmill

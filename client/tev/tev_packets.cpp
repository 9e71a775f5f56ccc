#include "client/tev/tev_packets.h"

#include <array>
#include <bit>
#include <cstring>

#include "common/base/check.h"

namespace lightmill {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian");

enum class Type : std::int8_t { create_image = 4, update_image_3 = 6 };
constexpr std::array<std::string_view, 3> kChannels{"R", "G", "B"};

class Packet {
 public:
  explicit Packet(Type type) {
    put(std::uint32_t{0});  // space for the length
    put(type);
  }
  template <class T>
  void put(T value) {
    static_assert(std::is_trivially_copyable_v<T>);
    const std::size_t at = bytes_.size();
    bytes_.resize(at + sizeof value);
    std::memcpy(bytes_.data() + at, &value, sizeof value);
  }
  void put_text(std::string_view text) {
    bytes_.append(text.substr(0, text.find('\0')));
    bytes_.push_back('\0');
  }
  void put_channels() {
    put(static_cast<std::int32_t>(kChannels.size()));
    for (const std::string_view channel : kChannels) {
      put_text(channel);
    }
  }
  void put_floats(std::span<const float> values) {
    bytes_.append(reinterpret_cast<const char*>(values.data()), values.size_bytes());
  }
  std::string take() {
    const auto length = static_cast<std::uint32_t>(bytes_.size());
    std::memcpy(bytes_.data(), &length, sizeof length);
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
};

}  // namespace

std::string tev_create_image(std::string_view name, int width, int height, bool grab_focus) {
  Packet packet(Type::create_image);
  packet.put(grab_focus);
  packet.put_text(name);
  packet.put(std::int32_t{width});
  packet.put(std::int32_t{height});
  packet.put_channels();
  return packet.take();
}

std::string tev_update_image(std::string_view name, int x, int y, int width, int height,
                             std::span<const float> planes) {
  const std::int64_t pixels = std::int64_t{width} * height;
  LM_CHECK(pixels > 0 && planes.size() == kChannels.size() * static_cast<std::size_t>(pixels));
  Packet packet(Type::update_image_3);
  packet.put(false);  // do not grab the focus
  packet.put_text(name);
  packet.put_channels();
  for (const int number : {x, y, width, height}) {
    packet.put(std::int32_t{number});
  }
  for (std::size_t channel = 0; channel < kChannels.size(); ++channel) {
    packet.put(static_cast<std::int64_t>(channel) * pixels);  // offset of the channel's values
  }
  for (std::size_t channel = 0; channel < kChannels.size(); ++channel) {
    packet.put(std::int64_t{1});  // stride of the channel's values
  }
  packet.put_floats(planes);
  return packet.take();
}

}  // namespace lightmill

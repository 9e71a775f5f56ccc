// Builder of glTF files for tests.
#pragma once

#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace lightmill::test {

inline std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t bits = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      bits = bits << 8 | (i + k < bytes.size() ? static_cast<std::uint8_t>(bytes[i + k]) : 0u);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      out += i + k > bytes.size() ? '=' : kDigits[bits >> (18 - 6 * k) & 63];
    }
  }
  return out;
}

/// The bytes of numbers as they lie in memory.
template <class T>
std::string packed(const std::vector<T>& values) {
  std::string out(values.size() * sizeof(T), '\0');
  std::memcpy(out.data(), values.data(), out.size());
  return out;
}

/// A file's binary data in parts. Each part is a buffer view with its own accessor.
class GltfBuffer {
 public:
  /// Adds an accessor; `more` are further members, each with a comma before it. Returns its index.
  int add(std::string_view bytes, std::string_view type, int component_type, std::size_t count,
          std::string_view more = "") {
    views_ += fmt::format(R"({}{{"buffer":0,"byteOffset":{},"byteLength":{}}})", views_.empty() ? "" : ",",
                          bytes_.size(), bytes.size());
    accessors_ += fmt::format(R"({}{{"bufferView":{},"type":"{}","componentType":{},"count":{}{}}})",
                              accessors_.empty() ? "" : ",", count_, type, component_type, count, more);
    bytes_ += bytes;
    bytes_.resize((bytes_.size() + 3) / 4 * 4);
    return count_++;
  }
  int positions(const std::vector<float>& values) { return add(packed(values), "VEC3", 5126, values.size() / 3); }
  int indices(const std::vector<std::uint16_t>& values) { return add(packed(values), "SCALAR", 5123, values.size()); }

  const std::string& bytes() const { return bytes_; }
  /// "buffers", "bufferViews" and "accessors"; `uri` is the buffer's, or empty for none.
  std::string members(std::string_view uri) const {
    return fmt::format(R"("buffers":[{{"byteLength":{}{}}}],"bufferViews":[{}],"accessors":[{}])", bytes_.size(),
                       uri.empty() ? "" : fmt::format(R"(,"uri":"{}")", uri), views_, accessors_);
  }
  std::string embedded() const { return members("data:application/octet-stream;base64," + base64(bytes_)); }

 private:
  std::string bytes_, views_, accessors_;
  int count_ = 0;
};

/// A file whose members stand beside its "asset".
inline std::string gltf(std::string_view members) {
  return fmt::format(R"({{"asset":{{"version":"2.0"}},{}}})", members);
}

inline std::string glb(std::string json, std::string_view binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const auto word = [](std::size_t value) { return packed<std::uint32_t>({static_cast<std::uint32_t>(value)}); };
  std::string out = "glTF" + word(2) + word(12 + 8 + json.size() + 8 + binary.size());
  out += word(json.size()) + "JSON" + json + word(binary.size()) + std::string("BIN\0", 4);
  out += binary;
  return out;
}

}  // namespace lightmill::test

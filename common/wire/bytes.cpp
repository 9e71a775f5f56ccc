#include "common/wire/bytes.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message_lite.h>

#include <bit>
#include <cstring>
#include <limits>

#include "common/base/check.h"

namespace lightmill {

static_assert(std::endian::native == std::endian::little, "floats are copied as they lie in memory");

std::string float_bytes(std::span<const float> values) {
  return std::string(reinterpret_cast<const char*>(values.data()), values.size_bytes());
}

Result<std::vector<float>> floats_from_bytes(std::string_view bytes) {
  if (bytes.size() % sizeof(float) != 0) {
    return invalid_argument("float values take a multiple of 4 bytes, got {}", bytes.size());
  }
  std::vector<float> values(bytes.size() / sizeof(float));
  if (!values.empty()) {
    std::memcpy(values.data(), bytes.data(), bytes.size());
  }
  return values;
}

std::string digest_bytes(const Sha256& digest) {
  return std::string(reinterpret_cast<const char*>(digest.bytes.data()), digest.bytes.size());
}

Result<Sha256> digest_from_bytes(std::string_view bytes) {
  Sha256 digest;
  if (bytes.size() != digest.bytes.size()) {
    return invalid_argument("a SHA-256 has 32 bytes, got {}", bytes.size());
  }
  std::memcpy(digest.bytes.data(), bytes.data(), bytes.size());
  return digest;
}

std::string hash_bytes(const Hash128& hash) {
  std::string bytes(16, '\0');
  for (int i = 0; i < 8; ++i) {
    bytes[i] = static_cast<char>(hash.high >> (56 - 8 * i));
    bytes[8 + i] = static_cast<char>(hash.low >> (56 - 8 * i));
  }
  return bytes;
}

Result<Hash128> hash_from_bytes(std::string_view bytes) {
  if (bytes.size() != 16) {
    return invalid_argument("an XXH3-128 has 16 bytes, got {}", bytes.size());
  }
  Hash128 hash;
  for (int i = 0; i < 8; ++i) {
    hash.high = hash.high << 8 | static_cast<std::uint8_t>(bytes[i]);
    hash.low = hash.low << 8 | static_cast<std::uint8_t>(bytes[8 + i]);
  }
  return hash;
}

Result<Hash128> trace_from_bytes(std::string_view bytes) {
  if (bytes.empty()) {
    return Hash128{};
  }
  return with_context(hash_from_bytes(bytes), "trace_id");
}

std::string deterministic_bytes(const google::protobuf::MessageLite& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    LM_CHECK(message.SerializeToCodedStream(&coded), "a message that cannot be serialised");
  }
  return bytes;
}

bool parse_bytes(std::string_view bytes, google::protobuf::MessageLite* message) {
  return bytes.size() <= static_cast<std::size_t>(std::numeric_limits<int>::max()) &&
         message->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace lightmill

#include "common/base/digest.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <xxhash.h>

#include <functional>
#include <new>

#include "common/base/check.h"

namespace lightmill {
namespace {

int hex_value(char c) {
  if (c >= '0' && c <= '9') {
    return c - '0';
  }
  if (c >= 'a' && c <= 'f') {
    return c - 'a' + 10;
  }
  if (c >= 'A' && c <= 'F') {
    return c - 'A' + 10;
  }
  return -1;
}

/// Reads exactly `out.size()` bytes from hex digits.
bool parse_hex(std::string_view text, std::span<std::uint8_t> out) {
  if (text.size() != 2 * out.size()) {
    return false;
  }
  for (std::size_t i = 0; i < out.size(); ++i) {
    const int high = hex_value(text[2 * i]);
    const int low = hex_value(text[2 * i + 1]);
    if (high < 0 || low < 0) {
      return false;
    }
    out[i] = static_cast<std::uint8_t>(high * 16 + low);
  }
  return true;
}

}  // namespace

std::string Sha256::hex() const {
  std::string text;
  text.reserve(64);
  for (const std::uint8_t byte : bytes) {
    fmt::format_to(std::back_inserter(text), "{:02x}", byte);
  }
  return text;
}

Result<Sha256> Sha256::from_hex(std::string_view text) {
  Sha256 digest;
  if (!parse_hex(text, digest.bytes)) {
    return invalid_argument("a SHA-256 is 64 hex digits, got '{}'", text);
  }
  return digest;
}

struct Sha256Hasher::State {
  State() {
    if (context == nullptr) {
      throw std::bad_alloc();
    }
  }
  ~State() { EVP_MD_CTX_free(context); }
  EVP_MD_CTX* const context = EVP_MD_CTX_new();
};

Sha256Hasher::Sha256Hasher() : state_(std::make_unique<State>()) {
  LM_CHECK(EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr) == 1);
}
Sha256Hasher::~Sha256Hasher() = default;

void Sha256Hasher::append(ByteView bytes) {
  LM_CHECK(EVP_DigestUpdate(state_->context, bytes.data(), bytes.size()) == 1);
}

Sha256 Sha256Hasher::finish() {
  Sha256 digest;
  LM_CHECK(EVP_DigestFinal_ex(state_->context, digest.bytes.data(), nullptr) == 1);
  return digest;
}

Sha256 sha256(ByteView bytes) {
  Sha256Hasher hasher;
  hasher.append(bytes);
  return hasher.finish();
}

Sha256 hmac_sha256(const Sha256& key, ByteView bytes) {
  Sha256 tag;
  LM_CHECK(HMAC(EVP_sha256(), key.bytes.data(), static_cast<int>(key.bytes.size()),
                reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size(), tag.bytes.data(),
                nullptr) != nullptr);
  return tag;
}

std::string Hash128::hex() const {
  return fmt::format("{:016x}{:016x}", high, low);
}

Result<Hash128> Hash128::from_hex(std::string_view text) {
  std::array<std::uint8_t, 16> bytes;
  if (!parse_hex(text, bytes)) {
    return invalid_argument("an XXH3-128 is 32 hex digits, got '{}'", text);
  }
  Hash128 hash;
  for (int i = 0; i < 8; ++i) {
    hash.high = hash.high << 8 | bytes[i];
    hash.low = hash.low << 8 | bytes[8 + i];
  }
  return hash;
}

struct Xxh3Hasher::State {
  XXH3_state_t* state = XXH3_createState();
  ~State() { XXH3_freeState(state); }
};

Xxh3Hasher::Xxh3Hasher() : state_(std::make_unique<State>()) {
  XXH3_128bits_reset(state_->state);
}
Xxh3Hasher::~Xxh3Hasher() = default;

void Xxh3Hasher::append(ByteView bytes) {
  XXH3_128bits_update(state_->state, bytes.data(), bytes.size());
}

Hash128 Xxh3Hasher::finish() const {
  const XXH128_hash_t hash = XXH3_128bits_digest(state_->state);
  return {hash.high64, hash.low64};
}

Hash128 xxh3_128(ByteView bytes) {
  const XXH128_hash_t hash = XXH3_128bits(bytes.data(), bytes.size());
  return {hash.high64, hash.low64};
}

}  // namespace lightmill

std::size_t std::hash<lightmill::Sha256>::operator()(const lightmill::Sha256& digest) const noexcept {
  std::size_t value;
  std::memcpy(&value, digest.bytes.data(), sizeof value);
  return value;
}

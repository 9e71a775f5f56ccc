// Bytes and their digests. SHA-256 names assets and jobs. XXH3-128 finds damage in results and stored rows.
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill {

using ByteView = std::span<const std::byte>;

inline ByteView as_byte_view(std::string_view text) {
  return std::as_bytes(std::span(text.data(), text.size()));
}

/// A little-endian number at `at`; empty if the bytes end before it.
template <class Number>
std::optional<Number> number_at(ByteView bytes, std::size_t at) {
  Number number{};
  if (at > bytes.size() || bytes.size() - at < sizeof(number)) {
    return std::nullopt;
  }
  std::memcpy(&number, bytes.data() + at, sizeof(number));
  return number;
}

/// A SHA-256, shown as 64 lower-case hex digits.
struct Sha256 {
  std::array<std::uint8_t, 32> bytes{};
  friend auto operator<=>(const Sha256&, const Sha256&) = default;
  std::string hex() const;
  /// Fails unless `text` is 64 hex digits.
  static Result<Sha256> from_hex(std::string_view text);
};

/// SHA-256 of the appended bytes, in order.
class Sha256Hasher {
 public:
  Sha256Hasher();
  ~Sha256Hasher();
  Sha256Hasher(const Sha256Hasher&) = delete;
  Sha256Hasher& operator=(const Sha256Hasher&) = delete;
  void append(ByteView bytes);
  void append(std::string_view text) { append(as_byte_view(text)); }
  Sha256 finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Sha256 sha256(ByteView bytes);
inline Sha256 sha256(std::string_view text) {
  return sha256(as_byte_view(text));
}

/// HMAC with SHA-256 (RFC 2104). Only a holder of the key can make it.
Sha256 hmac_sha256(const Sha256& key, ByteView bytes);

/// An XXH3-128, shown as 32 hex digits (high word first, XXHash's canonical form).
struct Hash128 {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  friend auto operator<=>(const Hash128&, const Hash128&) = default;
  std::string hex() const;
  /// Fails unless `text` is 32 hex digits.
  static Result<Hash128> from_hex(std::string_view text);
};

/// XXH3-128 of the appended bytes, in order.
class Xxh3Hasher {
 public:
  Xxh3Hasher();
  ~Xxh3Hasher();
  Xxh3Hasher(const Xxh3Hasher&) = delete;
  Xxh3Hasher& operator=(const Xxh3Hasher&) = delete;
  void append(ByteView bytes);
  Hash128 finish() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

Hash128 xxh3_128(ByteView bytes);

}  // namespace lightmill

template <>
struct std::hash<lightmill::Sha256> {
  std::size_t operator()(const lightmill::Sha256& digest) const noexcept;
};

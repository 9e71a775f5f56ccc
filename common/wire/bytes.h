// Floats and digests as bytes of messages, and messages as bytes.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace google::protobuf {
class MessageLite;
}

namespace lightmill {

/// Float32 values, little-endian.
std::string float_bytes(std::span<const float> values);

/// The inverse. Fails unless the length is a multiple of 4.
Result<std::vector<float>> floats_from_bytes(std::string_view bytes);

/// The 32 bytes of a SHA-256.
std::string digest_bytes(const Sha256& digest);

/// Fails unless there are 32 bytes.
Result<Sha256> digest_from_bytes(std::string_view bytes);

/// The 16 bytes of an XXH3-128, high word first, each word big-endian (XXHash's canonical form).
std::string hash_bytes(const Hash128& hash);

/// Fails unless there are 16 bytes.
Result<Hash128> hash_from_bytes(std::string_view bytes);

/// The `trace_id` of a message. Zero if the other program does not send traces.
Result<Hash128> trace_from_bytes(std::string_view bytes);

/// The message's bytes, for digests: fields in ascending order, maps sorted. Equal messages give equal bytes.
std::string deterministic_bytes(const google::protobuf::MessageLite& message);

/// Whether `bytes` are a message of this type. If so, fills `message`.
bool parse_bytes(std::string_view bytes, google::protobuf::MessageLite* message);

}  // namespace lightmill

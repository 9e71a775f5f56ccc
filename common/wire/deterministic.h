// Deterministic serialisation: equal messages give equal bytes, for digests.
#pragma once

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <google/protobuf/message_lite.h>

#include <limits>
#include <string>
#include <string_view>

#include "common/base/check.h"

namespace lightmill {

/// The message's bytes: fields in ascending order, maps sorted.
inline std::string deterministic_bytes(const google::protobuf::MessageLite& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    LM_CHECK(message.SerializeToCodedStream(&coded), "a message that cannot be serialised");
  }
  return bytes;
}

/// Whether `bytes` are a message of this type. If so, fills `message`.
inline bool parse_bytes(std::string_view bytes, google::protobuf::MessageLite* message) {
  return bytes.size() <= static_cast<std::size_t>(std::numeric_limits<int>::max()) &&
         message->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

}  // namespace lightmill

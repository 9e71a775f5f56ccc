// Protocol between a program and its decoder of images and compressed meshes. Its socket is the decoder's standard
// input.
//
// A request is one socket message with two descriptors: the file's bytes, and a pipe for the pixels or the mesh's
// arrays. Each request has one reply. Before the pixels or arrays, the pipe carries the reply that will follow if all
// of them can be read. Both programs are from the same build, so values are sent as they are in memory.
#pragma once

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "common/image/decoder/compressed_mesh.h"

namespace lightmill {

enum class DecodeKind : std::uint32_t { image, mesh };

struct DecodeRequest {
  std::uint64_t file_bytes = 0;
  std::int64_t max_pixels = 0;  ///< larger images are refused; 0: only the header is read
  std::int64_t time_ms = 0;     ///< wall-clock limit for reading
  DecodeKind kind = DecodeKind::image;
  // Of meshes, as in MeshRequest:
  std::uint32_t fewer_triangles = 0;
  std::uint64_t vertices = 0, triangles = 0;
  std::uint32_t attribute_count = 0;
  std::array<CompressedAttribute, kMaxCompressedAttributes> attributes{};
};

/// The child's answer. A malicious file may control the child, so the receiver checks every field.
struct DecodeReply {
  std::int32_t code = 0;  ///< a StatusCode
  std::int32_t width = 0, height = 0;
  std::uint32_t bytes_per_pixel = 0;
  std::uint32_t encoded = 0, half = 0;
  std::uint32_t orientation = 0, gamma = 0, profile = 0;  ///< IgnoredProperties
  std::uint64_t vertices = 0, triangles = 0;              ///< of a mesh
  std::array<char, 1000> text{};                          ///< error message without the file's name
};

inline DecodeReply error_reply(const Status& status) {
  DecodeReply reply;
  reply.code = static_cast<std::int32_t>(status.code());
  const std::string text = message_of(status);
  text.copy(reply.text.data(), reply.text.size() - 1);
  return reply;
}

inline Status write_all(int descriptor, ByteView bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor, bytes.data(), bytes.size());
    if (written <= 0 && errno != EINTR) {
      return resource_exhausted("{} bytes cannot be sent: {}", bytes.size(), std::strerror(errno));
    }
    bytes = bytes.subspan(static_cast<std::size_t>(std::max<ssize_t>(written, 0)));
  }
  return ok_status();
}

/// The decoder's option to work without a sandbox if the kernel refuses it.
inline constexpr const char* kUnsandboxedFlag = "--unsandboxed";
/// The option of other programs for the same.
inline constexpr const char* kUnsandboxedImages = "--unsandboxed-images";
/// The decoder's option to print its fingerprint (decoder/fingerprint.h) and end.
inline constexpr const char* kFingerprintFlag = "--fingerprint";

}  // namespace lightmill

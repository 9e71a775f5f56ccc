#include "decoder/decode.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/image/read/opened_image.h"

namespace lightmill {
namespace {

/// For the header, and in addition to pixels.
constexpr std::uint64_t kBaseMemory = std::uint64_t{512} << 20;
/// Per pixel while it is decoded: its bytes in Texels, and as much again for readers, or for pixels to be moved.
constexpr std::uint64_t kMemoryOfPixel = 32;
constexpr std::uint64_t kMostBytesOfPixel = 16;

/// Maps a file into memory.
Result<std::byte*> mapped(int file, std::uint64_t size, int protection) {
  void* const start = ::mmap(nullptr, size, protection, MAP_SHARED | MAP_POPULATE, file, 0);
  return start == MAP_FAILED ? Result<std::byte*>(resource_exhausted("no memory for {} bytes of the image: {}", size,
                                                                     std::strerror(errno)))
                             : static_cast<std::byte*>(start);
}

std::uint64_t memory_for(const DecodeRequest& request, std::uint64_t pixels) {
  return kBaseMemory + request.file_bytes + pixels * kMemoryOfPixel;
}

Result<DecodeReply> try_decode(const DecodeRequest& request, int file, int room) {
  std::byte* bytes = nullptr;
  if (request.file_bytes > 0) {
    LM_ASSIGN_OR_RETURN(bytes, mapped(file, request.file_bytes, PROT_READ));
  }
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<OpenedImage> image, OpenedImage::open({bytes, request.file_bytes}));
  DecodeReply reply;
  reply.width = image->width();
  reply.height = image->height();
  reply.bytes_per_pixel = image->size().bytes_per_pixel;
  reply.encoded = image->encoded() ? 1 : 0;
  const IgnoredProperties ignored = image->size().ignored;
  reply.orientation = ignored.orientation ? 1 : 0;
  reply.gamma = ignored.gamma ? 1 : 0;
  reply.profile = ignored.profile ? 1 : 0;
  if (request.max_pixels == 0) {
    return reply;
  }
  LM_RETURN_IF_ERROR(image->check_limit(request.max_pixels));
  grow_memory(memory_for(request, image->most_pixels()));
  const std::uint64_t size = image->size().pixels() * reply.bytes_per_pixel;
  if (::ftruncate(room, static_cast<off_t>(size)) != 0) {
    return resource_exhausted("no room for {} bytes of pixels: {}", size, std::strerror(errno));
  }
  LM_ASSIGN_OR_RETURN(std::byte* const pixels, mapped(room, size, PROT_READ | PROT_WRITE));
  const Status read = image->read(pixels);
  ::munmap(pixels, size);  // the caller seals the file, so no mapping may be left
  LM_RETURN_IF_ERROR(read);
  return reply;
}

}  // namespace

ChildLimits limits_for(const DecodeRequest& request) {
  const auto pixels = static_cast<std::uint64_t>(request.max_pixels);
  return {memory_for(request, 0), memory_for(request, pixels), pixels * kMostBytesOfPixel,
          std::chrono::milliseconds(request.time_ms)};
}

DecodeReply decode(const DecodeRequest& request, int file, int room) {
  const Result<DecodeReply> reply = try_decode(request, file, room);
  return reply.ok() ? *reply : error_reply(reply.status());
}

}  // namespace lightmill

#include "decoder/decode.h"

#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "common/image/read/opened_image.h"
#include "decoder/draco_mesh.h"

namespace lightmill {
namespace {

/// For the header, and in addition to pixels.
constexpr std::uint64_t kBaseMemory = std::uint64_t{512} << 20;
/// Per pixel while it is decoded, if all have to be read before the first is sent: its bytes, and as much again.
constexpr std::uint64_t kMemoryOfPixel = 32;
/// Per triangle and per vertex of a mesh: the tables of its edges, and each attribute as integers, as floats and as it is
/// sent. A little more than Draco needs.
constexpr std::uint64_t kMemoryOfTriangle = 256, kMemoryOfVertex = 128, kMemoryOfComponent = 24;

constexpr FileWords kMeshWords{"the mesh", "export it again", "export it again, or without compression",
                               "export it without compression, or in smaller parts"};

/// Maps a file into memory.
Result<ByteView> mapped(int file, std::uint64_t size) {
  void* const start = ::mmap(nullptr, size, PROT_READ, MAP_SHARED | MAP_POPULATE, file, 0);
  return start == MAP_FAILED
             ? Result<ByteView>(resource_exhausted("no memory for its {} bytes: {}", size, std::strerror(errno)))
             : ByteView(static_cast<const std::byte*>(start), size);
}

std::uint64_t memory_for(const DecodeRequest& request, std::uint64_t pixels) {
  return kBaseMemory + request.file_bytes + pixels * kMemoryOfPixel;
}

MeshRequest mesh_of(const DecodeRequest& request) {
  const std::size_t count = std::min<std::size_t>(request.attribute_count, request.attributes.size());
  return {request.vertices,
          request.triangles,
          request.fewer_triangles != 0,
          {request.attributes.begin(), request.attributes.begin() + static_cast<std::ptrdiff_t>(count)}};
}

std::uint64_t memory_for_mesh(const DecodeRequest& request) {
  std::uint64_t components = 0;
  for (const CompressedAttribute& attribute : mesh_of(request).attributes) {
    components += attribute.components;
  }
  return kBaseMemory + 2 * request.file_bytes + request.triangles * kMemoryOfTriangle +
         request.vertices * (kMemoryOfVertex + components * kMemoryOfComponent);
}

Result<DecodeReply> try_decode_mesh(const DecodeRequest& request, int file, int out) {
  ByteView bytes;
  if (request.file_bytes > 0) {
    LM_ASSIGN_OR_RETURN(bytes, mapped(file, request.file_bytes));
  }
  LM_ASSIGN_OR_RETURN(const DracoMesh mesh, DracoMesh::decode(bytes, mesh_of(request)));
  DecodeReply reply;
  reply.vertices = mesh.vertices();
  reply.triangles = mesh.triangles();
  LM_RETURN_IF_ERROR(write_all(out, as_byte_view({reinterpret_cast<const char*>(&reply), sizeof(reply)})));
  LM_RETURN_IF_ERROR(mesh.write([out](ByteView piece) { return write_all(out, piece); }));
  return reply;
}

Result<DecodeReply> try_decode_image(const DecodeRequest& request, int file, int pixels) {
  ByteView bytes;
  if (request.file_bytes > 0) {
    LM_ASSIGN_OR_RETURN(bytes, mapped(file, request.file_bytes));
  }
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<OpenedImage> image, OpenedImage::open(bytes));
  DecodeReply reply;
  reply.width = image->width();
  reply.height = image->height();
  reply.bytes_per_pixel = image->size().bytes_per_pixel;
  reply.encoded = image->encoded() ? 1 : 0;
  reply.half = image->half() ? 1 : 0;
  const IgnoredProperties ignored = image->size().ignored;
  reply.orientation = ignored.orientation ? 1 : 0;
  reply.gamma = ignored.gamma ? 1 : 0;
  reply.profile = ignored.profile ? 1 : 0;
  if (request.max_pixels == 0) {
    return reply;
  }
  LM_RETURN_IF_ERROR(image->check_limit(request.max_pixels));
  grow_memory(memory_for(request, image->most_pixels()));
  LM_RETURN_IF_ERROR(write_all(pixels, as_byte_view({reinterpret_cast<const char*>(&reply), sizeof(reply)})));
  LM_RETURN_IF_ERROR(image->read([pixels](ByteView rows) { return write_all(pixels, rows); }));
  return reply;
}

}  // namespace

ChildLimits limits_for(const DecodeRequest& request) {
  const std::chrono::milliseconds time(request.time_ms);
  if (request.kind == DecodeKind::mesh) {
    const std::uint64_t memory = memory_for_mesh(request);
    return {memory, memory, 0, time, kMeshWords};
  }
  const auto pixels = static_cast<std::uint64_t>(request.max_pixels);
  return {memory_for(request, 0), memory_for(request, pixels), 0, time, {}};
}

DecodeReply decode(const DecodeRequest& request, int file, int out) {
  const Result<DecodeReply> reply =
      request.kind == DecodeKind::mesh ? try_decode_mesh(request, file, out) : try_decode_image(request, file, out);
  return reply.ok() ? *reply : error_reply(reply.status());
}

}  // namespace lightmill

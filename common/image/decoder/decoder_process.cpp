#include "common/image/decoder/decoder_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstring>
#include <optional>
#include <thread>

#include "common/base/child_program.h"
#include "common/base/descriptor.h"
#include "common/base/file.h"
#include "common/base/text.h"
#include "common/image/texels.h"

namespace lightmill {
namespace {

/// For start and end, in addition to the file's time.
constexpr std::chrono::milliseconds kGrace = std::chrono::seconds(30);

constexpr int kPipeBytes = 1 << 20;  ///< the largest pipe without privileges (Linux's default)
constexpr std::size_t kMaxFingerprintBytes = 65536;
constexpr std::chrono::milliseconds kEndPause(5);  ///< between two checks whether a process has ended

/// The error in a reply.
Status status_of(const DecodeReply& reply) {
  const auto code = static_cast<StatusCode>(reply.code);
  const std::string text = library_text({reply.text.data(), ::strnlen(reply.text.data(), reply.text.size())});
  switch (code) {
    case StatusCode::kOk:
      return ok_status();
    case StatusCode::kResourceExhausted:
    case StatusCode::kFailedPrecondition:
      return make_error(code, "{}", text);
    default:
      return invalid_argument("{}", text);
  }
}

Status check_image_reply(const DecodeReply& reply) {
  LM_RETURN_IF_ERROR(status_of(reply));
  const bool known = reply.bytes_per_pixel == 4 || reply.bytes_per_pixel == 8 || reply.bytes_per_pixel == 16;
  const bool sound = known && reply.width > 0 && reply.height > 0;
  return sound ? ok_status() : invalid_argument("the image is damaged: its decoder sent an invalid reply");
}

Status check_mesh_reply(const DecodeReply& reply, const MeshRequest& request) {
  LM_RETURN_IF_ERROR(status_of(reply));
  const bool sound =
      reply.vertices == request.vertices &&
      (request.fewer_triangles ? reply.triangles <= request.triangles : reply.triangles == request.triangles);
  return sound ? ok_status() : invalid_argument("the mesh is damaged: its decoder sent an invalid reply");
}

}  // namespace

/// Input from the decoder: pixels or arrays through a pipe, and replies over its socket.
struct FromDecoder {
  int pipe = -1, socket = -1;
  std::chrono::milliseconds timeout{0};  ///< the longest wait for data

  /// Waits until there is something to read. False if the socket was shut first.
  bool wait_for(int descriptor) const {
    std::array<pollfd, 2> ready{pollfd{descriptor, POLLIN, 0}, pollfd{socket, POLLRDHUP, 0}};
    while (::poll(ready.data(), ready.size(), static_cast<int>(timeout.count())) < 0 && errno == EINTR) {
    }
    return ready[0].revents != 0;
  }
  /// False if the pipe ends before. The decoder ends a slow child.
  bool read_bytes(std::span<std::byte> bytes) const {
    while (!bytes.empty()) {
      const ssize_t got = wait_for(pipe) ? ::read(pipe, bytes.data(), bytes.size()) : 0;
      if (got <= 0) {
        return false;
      }
      bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
    return true;
  }
};

namespace {

/// Reads the pixels of an image. OK also if the pipe ends early: then the decoder's reply has the error.
Status receive_pixels(const FromDecoder& from, std::int64_t max_pixels, Texels& texels) {
  DecodeReply head;
  if (!from.read_bytes(std::as_writable_bytes(std::span(&head, 1)))) {
    return ok_status();
  }
  LM_RETURN_IF_ERROR(check_image_reply(head));
  LM_RETURN_IF_ERROR(check_pixels(head.width, head.height, max_pixels));
  const auto count = static_cast<std::size_t>(head.width) * static_cast<std::size_t>(head.height);
  const std::size_t size = count * head.bytes_per_pixel;
  void* const start = ::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (start == MAP_FAILED) {
    return resource_exhausted("no memory for {}x{} pixels: {}", head.width, head.height, std::strerror(errno));
  }
  const std::shared_ptr<const void> owner(start,
                                          [size](const void* pixels) { ::munmap(const_cast<void*>(pixels), size); });
  ::madvise(start, size, MADV_HUGEPAGE);  // fewer page faults here, and fewer TLB misses of rendering
  if (!from.read_bytes({static_cast<std::byte*>(start), size})) {
    return ok_status();
  }
  texels = {head.width, head.height, {}, {}, head.encoded != 0};
  if (head.bytes_per_pixel == 4) {
    texels.bytes = {owner, {static_cast<const std::uint32_t*>(start), count}};
  } else if (head.bytes_per_pixel == 8) {
    texels.words = {owner, {static_cast<const std::uint64_t*>(start), count}};
    texels.half = head.half != 0;
  } else {
    texels.floats = {owner, {static_cast<const float*>(start), 4 * count}};
  }
  return check_finite(texels);
}

/// Reads the arrays of a mesh. There is no `mesh` unless all of them came.
Status receive_arrays(const FromDecoder& from, const MeshRequest& request, std::optional<DecodedMesh>& mesh) {
  mesh.reset();
  DecodeReply head;
  if (!from.read_bytes(std::as_writable_bytes(std::span(&head, 1)))) {
    return ok_status();
  }
  LM_RETURN_IF_ERROR(check_mesh_reply(head, request));
  DecodedMesh received;
  received.corners.resize(3 * head.triangles);
  if (!from.read_bytes(std::as_writable_bytes(std::span(received.corners)))) {
    return ok_status();
  }
  for (const std::uint32_t corner : received.corners) {
    if (corner >= request.vertices) {
      return invalid_argument("the compressed data are damaged: vertex {} is out of range, there are {}", corner,
                              request.vertices);
    }
  }
  for (const CompressedAttribute& attribute : request.attributes) {
    std::string& numbers = received.attributes.emplace_back();
    numbers.resize(request.vertices * attribute.components * component_bytes(attribute.type));
    if (!from.read_bytes(std::as_writable_bytes(std::span(numbers)))) {
      return ok_status();
    }
  }
  mesh = std::move(received);
  return ok_status();
}

/// Starts the decoder with these descriptors as its input and output. `flag` may be null.
Result<pid_t> spawn_decoder(const std::filesystem::path& path, const char* flag, int input, int output) {
  return start_child({path, flag, input, output, true});
}

}  // namespace

std::filesystem::path image_decoder_program() {
  return own_folder() / "lightmill-image-decoder";
}

Result<std::string> fingerprint_of_decoder(const std::filesystem::path& path, const Clock& clock,
                                           std::chrono::milliseconds time_limit) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    return resource_exhausted("cannot create a pipe for the image decoder: {}", std::strerror(errno));
  }
  const Descriptor output(ends[0]);
  Descriptor childs(ends[1]);
  LM_ASSIGN_OR_RETURN(const pid_t pid, spawn_decoder(path, kFingerprintFlag, -1, ends[1]));
  childs.close();
  const Time end = clock.now() + time_limit;
  const auto waits = [&] {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(end - clock.now());
    return FromDecoder{.timeout = std::max(left, std::chrono::milliseconds(0))}.wait_for(output.number());
  };
  std::string text;
  std::array<char, 256> part{};
  ssize_t size = 0;
  bool late = false;
  while (text.size() <= kMaxFingerprintBytes && !(late = !waits()) &&
         ((size = ::read(output.number(), part.data(), part.size())) > 0 || (size < 0 && errno == EINTR))) {
    text.append(part.data(), static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  }
  int status = 0;
  while (::waitpid(pid, &status, WNOHANG) == 0) {
    late = late || clock.now() >= end;
    if (late) {
      ::kill(-pid, SIGKILL);  // with processes that it started
    }
    std::this_thread::sleep_for(kEndPause);
  }
  if (late) {
    return failed_precondition("{} {} did not end within {:g} s: run it by hand to see why, then start this again",
                               path.string(), kFingerprintFlag, std::chrono::duration<double>(time_limit).count());
  }
  if (status != 0 || text.empty()) {
    return failed_precondition("{} {} fails: {}", path.string(), kFingerprintFlag, end_text(status));
  }
  return text.substr(0, text.find('\n'));
}

Status DecoderProcess::start() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return resource_exhausted("cannot create a socket for the image decoder: {}", std::strerror(errno));
  }
  const Descriptor childs(ends[1]);
  Result<pid_t> pid = spawn_decoder(options_.program, options_.unsandboxed ? kUnsandboxedFlag : nullptr, ends[1], -1);
  if (!pid.ok()) {
    ::close(ends[0]);
    return pid.status();
  }
  pid_ = *pid;
  socket_ = ends[0];
  return ok_status();
}

std::string DecoderProcess::stop() {
  if (pid_ == 0) {
    return "";
  }
  ::close(std::exchange(socket_, -1));
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) == 0) {
    ::kill(pid_, SIGKILL);
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  pid_ = 0;
  return end_text(status);
}

/// UNAVAILABLE if the process is gone.
Result<DecodeReply> DecoderProcess::exchange(const DecodeRequest& request, int file, const Receive& receive) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
    return resource_exhausted("cannot create a pipe from its decoder: {}", std::strerror(errno));
  }
  Descriptor pipe(ends[0]);
  // The decoder kills its child when the socket closes.
  const std::stop_callback stopped(stop_, [this] { ::shutdown(socket_, SHUT_RDWR); });
  {
    const Descriptor childs(ends[1]);
    ::fcntl(childs.number(), F_SETPIPE_SZ, kPipeBytes);
    iovec part{const_cast<DecodeRequest*>(&request), sizeof(request)};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(2 * sizeof(int))> control{};
    msghdr message{};
    message.msg_iov = &part;
    message.msg_iovlen = 1;
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(2 * sizeof(int));
    const std::array<int, 2> descriptors{file, childs.number()};
    std::memcpy(CMSG_DATA(header), descriptors.data(), sizeof(descriptors));
    if (::sendmsg(socket_, &message, MSG_NOSIGNAL) != static_cast<ssize_t>(sizeof(request))) {
      return unavailable("{}", std::strerror(errno));
    }
  }
  const FromDecoder from{pipe.number(), socket_, options_.time_limit + kGrace};
  const Status received = receive(from);
  pipe.close();  // ends a child that would send more
  DecodeReply reply;
  if (!from.wait_for(socket_) || ::recv(socket_, &reply, sizeof(reply), 0) != static_cast<ssize_t>(sizeof(reply))) {
    return unavailable("no answer");
  }
  return received.ok() ? Result<DecodeReply>(reply) : received;
}

Result<DecodeReply> DecoderProcess::ask(ByteView bytes, DecodeRequest request, const Receive& receive) {
  if (stop_.stop_requested()) {
    return cancelled("it is no longer needed");
  }
  const Descriptor file(::memfd_create("file", MFD_CLOEXEC | MFD_ALLOW_SEALING));
  if (file.number() < 0) {
    return resource_exhausted("cannot create a file in memory for its decoder: {}", std::strerror(errno));
  }
  LM_RETURN_IF_ERROR(write_all(file.number(), bytes));
  ::fcntl(file.number(), F_ADD_SEALS, F_SEAL_WRITE | F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_SEAL);
  request.file_bytes = bytes.size();
  request.time_ms = options_.time_limit.count();
  std::string end;
  for (int attempt = 0; attempt < 2; ++attempt) {  // it may have been killed while idle
    if (pid_ == 0) {
      LM_RETURN_IF_ERROR(start());
    }
    Result<DecodeReply> reply = exchange(request, file.number(), receive);
    if (reply.ok()) {
      LM_RETURN_IF_ERROR(status_of(*reply));
      return reply;
    }
    if (reply.status().code() != StatusCode::kUnavailable) {
      return reply;
    }
    end = stop();
    if (stop_.stop_requested()) {
      return cancelled("it is no longer needed");
    }
  }
  return failed_precondition("cannot decode it: {} was started twice and ended ({}). Run it by hand to see why",
                             options_.program.string(), end);
}

Result<ImageSize> DecoderProcess::size(ByteView bytes, const std::string& name) {
  const auto nothing = [](const FromDecoder&) { return ok_status(); };
  LM_ASSIGN_OR_RETURN(const DecodeReply reply, with_context(ask(bytes, {}, nothing), name));
  LM_RETURN_IF_ERROR(with_context(check_image_reply(reply), name));
  return ImageSize{
      reply.width, reply.height, reply.bytes_per_pixel, {reply.orientation != 0, reply.gamma != 0, reply.profile != 0}};
}

Result<Texels> DecoderProcess::decode(ByteView bytes, const std::string& name, std::int64_t max_pixels) {
  Texels texels;
  DecodeRequest request;
  request.max_pixels = max_pixels;
  Status status =
      ask(bytes, request, [&](const FromDecoder& from) { return receive_pixels(from, max_pixels, texels); }).status();
  if (status.ok() && texels.width == 0) {
    status = invalid_argument("the image is damaged: it has fewer pixels than its header says");
  }
  return status.ok() ? Result<Texels>(std::move(texels)) : with_context(status, name);
}

Result<DecodedMesh> DecoderProcess::decode_mesh(ByteView bytes, const MeshRequest& wanted) {
  LM_RETURN_IF_ERROR(check_request(wanted));
  DecodeRequest request;
  request.kind = DecodeKind::mesh;
  request.vertices = wanted.vertices;
  request.triangles = wanted.triangles;
  request.fewer_triangles = wanted.fewer_triangles ? 1 : 0;
  request.attribute_count = static_cast<std::uint32_t>(wanted.attributes.size());
  std::ranges::copy(wanted.attributes, request.attributes.begin());
  std::optional<DecodedMesh> mesh;
  LM_RETURN_IF_ERROR(
      ask(bytes, request, [&](const FromDecoder& from) { return receive_arrays(from, wanted, mesh); }).status());
  return mesh ? Result<DecodedMesh>(*std::move(mesh))
              : invalid_argument("the compressed data are damaged: the decoder sent less than it announced");
}

}  // namespace lightmill

// A decoder that answers each request for a mesh with a lie, which its own file name says. For tests of what its caller
// checks.
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>

#include "common/image/decoder/decoder_protocol.h"

namespace lightmill {
namespace {

/// The number of the pipe, or −1 if the caller is gone.
int receive(DecodeRequest& request) {
  iovec part{&request, sizeof(request)};
  std::array<int, 2> descriptors{};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(descriptors))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  if (::recvmsg(STDIN_FILENO, &message, 0) != static_cast<ssize_t>(sizeof(request))) {
    return -1;
  }
  std::memcpy(descriptors.data(), CMSG_DATA(CMSG_FIRSTHDR(&message)), sizeof(descriptors));
  ::close(descriptors[0]);
  return descriptors[1];
}

void answer(const DecodeRequest& request, int pipe, const std::string& lie) {
  DecodeReply reply;
  reply.vertices = request.vertices + (lie == "more-vertices" ? 1 : 0);
  reply.triangles = lie == "many-triangles" ? std::uint64_t{1} << 62 : request.triangles - (lie == "fewer-triangles");
  std::string out(reinterpret_cast<const char*>(&reply), sizeof(reply));
  std::vector<std::uint32_t> corners(3 * request.triangles, 0);
  corners.back() = static_cast<std::uint32_t>(request.vertices) - (lie == "outside" ? 0 : 1);
  out.append(reinterpret_cast<const char*>(corners.data()), corners.size() * sizeof(std::uint32_t));
  for (std::uint32_t i = 0; i < request.attribute_count; ++i) {
    const CompressedAttribute& attribute = request.attributes[i];
    out.append(request.vertices * attribute.components * component_bytes(attribute.type), '\0');
  }
  if (lie == "nothing") {
    out.clear();
  } else if (lie == "short") {
    out.pop_back();
  } else if (lie == "long") {
    out.append(1000, 'x');
  }
  [[maybe_unused]] const Status written = write_all(pipe, as_byte_view(out));
  ::close(pipe);
  [[maybe_unused]] const ssize_t sent = ::send(STDIN_FILENO, &reply, sizeof(reply), MSG_NOSIGNAL);
}

}  // namespace
}  // namespace lightmill

int main(int, char** argv) {
  lightmill::DecodeRequest request;
  for (int pipe = 0; (pipe = lightmill::receive(request)) >= 0;) {
    lightmill::answer(request, pipe, std::filesystem::path(argv[0]).filename());
  }
}

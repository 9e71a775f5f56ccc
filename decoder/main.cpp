// lightmill-image-decoder: decodes images and compressed meshes for the program that starts it, each in a sandboxed child.
//
// The libraries are loaded once. For each request (common/image/decoder/decoder_protocol.h) it forks a child, which
// reads one file and ends. From a file, only the child's reply reaches this process, which passes it on.
#include <grp.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <OpenImageIO/imageio.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <iostream>
#include <string_view>

#include "decoder/decode.h"
#include "decoder/fingerprint.h"

namespace lightmill {
namespace {

constexpr int kAsker = STDIN_FILENO;
constexpr uid_t kNobody = 65'534;

/// Prepares the libraries once, for all children. Their own threads would not survive a fork.
void prepare_readers() {
  OIIO::attribute("threads", 1);
  OIIO::attribute("exr_threads", -1);
  OIIO::attribute("try_all_readers", 0);
  OIIO::get_string_attribute("format_list");  // creates the table of readers
}

/// If memory runs short, the kernel kills this process and its children before the program that uses it.
void be_first_to_go() {
  std::ofstream("/proc/self/oom_score_adj") << "1000";
}

/// Changes from root to nobody. A root that may not do this has few other rights.
void become_nobody() {
  if (::geteuid() == 0 && ::setgroups(0, nullptr) == 0 && ::setresgid(kNobody, kNobody, kNobody) == 0) {
    [[maybe_unused]] const int refused = ::setresuid(kNobody, kNobody, kNobody);
  }
}

/// False when the caller is gone. A message without two descriptors is not from a program of ours.
bool receive(DecodeRequest& request, std::array<int, 2>& descriptors) {
  iovec part{&request, sizeof(request)};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(descriptors))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t size = 0;
  while ((size = ::recvmsg(kAsker, &message, MSG_CMSG_CLOEXEC)) < 0 && errno == EINTR) {
  }
  const cmsghdr* header = CMSG_FIRSTHDR(&message);
  if (size != static_cast<ssize_t>(sizeof(request)) || header == nullptr || header->cmsg_type != SCM_RIGHTS ||
      header->cmsg_len != CMSG_LEN(sizeof(descriptors))) {
    return false;
  }
  std::memcpy(descriptors.data(), CMSG_DATA(header), sizeof(descriptors));
  return true;
}

int serve(bool unsandboxed) {
  const Result<SystemCallFilter> filter = SystemCallFilter::make();
  if (!filter.ok()) {
    std::cerr << "lightmill-image-decoder: " << message_of(filter.status()) << "\n";
    return 1;
  }
  const Confinement confinement{*filter, unsandboxed, kAsker};
  DecodeRequest request;
  std::array<int, 2> descriptors{};
  while (receive(request, descriptors)) {
    const DecodeReply reply = run_confined(confinement, limits_for(request), descriptors,
                                           [&] { return decode(request, kFileDescriptor, kPixelDescriptor); });
    if (::send(kAsker, &reply, sizeof(reply), MSG_NOSIGNAL) != static_cast<ssize_t>(sizeof(reply))) {
      return 1;
    }
  }
  return 0;
}

int print_fingerprint() {
  prepare_readers();
  const Result<std::string> fingerprint = decoder_fingerprint();
  if (!fingerprint.ok()) {
    std::cerr << "lightmill-image-decoder: " << message_of(fingerprint.status()) << "\n";
    return 1;
  }
  std::cout << *fingerprint << std::endl;
  return 0;
}

int run(int argc, char** argv) {
  if (argc > 1 && std::string_view(argv[1]) == kFingerprintFlag) {
    return print_fingerprint();
  }
  int type = 0;
  socklen_t size = sizeof(type);
  if (::getsockopt(kAsker, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_SEQPACKET) {
    std::cerr
        << "lightmill-image-decoder: decodes images and meshes for lightmill and lightmill-worker,\nwhich start it\n";
    return 2;
  }
  prepare_readers();
  be_first_to_go();
  become_nobody();
  return serve(argc > 1 && std::string_view(argv[1]) == kUnsandboxedFlag);
}

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  return lightmill::run(argc, argv);
}

#include "worker/inspect/scene_reader.h"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>
#include <cstring>
#include <fstream>
#include <iostream>

#include "common/base/number_text.h"
#include "common/base/out_of_memory.h"
#include "common/base/sanitizers.h"
#include "common/wire/inspection_bytes.h"
#include "worker/inspect/inspect_scene.h"
#include "worker/inspect/reader_socket.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kMaxStartBytes = std::uint64_t{64} << 20;
constexpr std::uint64_t kSpareCpuSeconds = 5;  ///< between the signal of the CPU limit and the kill

/// Bytes of data and stack of this process.
std::uint64_t data_bytes() {
  std::array<std::uint64_t, 6> pages{};
  std::ifstream statm("/proc/self/statm");
  for (std::uint64_t& number : pages) {
    statm >> number;
  }
  return pages[5] * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// Lowers a limit. The image decoder inherits it.
void limit(__rlimit_resource resource, std::uint64_t soft, std::uint64_t hard) {
  rlimit value{};
  if (::getrlimit(resource, &value) == 0) {
    value.rlim_max = std::min<rlim_t>(value.rlim_max, hard);
    value.rlim_cur = std::min<rlim_t>(value.rlim_max, soft);
    ::setrlimit(resource, &value);
  }
}

void set_limits(const ReaderStart& start) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  std::ofstream("/proc/self/oom_score_adj") << "1000";
  limit(RLIMIT_CORE, 0, 0);
  limit(RLIMIT_CPU, start.cpu_seconds, start.cpu_seconds + kSpareCpuSeconds);
  if (!kSanitized) {  // the shadow memory of sanitizers exceeds any limit
    const std::uint64_t most = data_bytes() + start.memory_bytes;
    limit(RLIMIT_DATA, most, most);
  }
  exit_on_out_of_memory("lightmill-worker: a scene reader", kReaderOutOfMemory);
}

/// Sends a message, and returns the bytes of the reply.
Result<std::string> ask(ReaderSocket& worker, ReaderMessage message, std::initializer_list<std::string_view> parts) {
  LM_RETURN_IF_ERROR(worker.send(message, parts));
  LM_ASSIGN_OR_RETURN(ReaderSocket::Received received, worker.receive());
  return std::move(received.bytes);
}

std::string_view bytes_of(const Sha256& digest) {
  static_assert(std::is_trivially_copyable_v<Sha256>);
  return {reinterpret_cast<const char*>(&digest), sizeof(digest)};
}

Status upload(ReaderSocket& worker, const std::map<Sha256, std::string>& assets) {
  std::string digests;
  for (const auto& [digest, bytes] : assets) {
    digests += bytes_of(digest);
  }
  LM_ASSIGN_OR_RETURN(const std::string missing, ask(worker, ReaderMessage::offer, {digests}));
  for (std::size_t at = 0; at + sizeof(Sha256) <= missing.size(); at += sizeof(Sha256)) {
    Sha256 digest;
    std::memcpy(&digest, missing.data() + at, sizeof(digest));
    const auto found = assets.find(digest);
    if (found == assets.end()) {
      return internal_error("the coordinator asks for asset {}, which it was not asked about", digest.hex());
    }
    LM_RETURN_IF_ERROR(ask(worker, ReaderMessage::asset, {bytes_of(digest), found->second}).status());
  }
  return ok_status();
}

Result<Inspection> read(ReaderSocket& worker, const ReaderStart& start, std::string_view rest) {
  const std::string_view decoder = rest.substr(0, start.decoder_path_bytes);
  LM_ASSIGN_OR_RETURN(const InspectionRequest request, unpack_request(rest.substr(decoder.size())));
  DecoderProcess images(
      {std::filesystem::path(decoder), start.unsandboxed != 0, std::chrono::milliseconds(start.image_ms)});
  const InspectionHooks hooks{
      [&](const Sha256& digest) { return ask(worker, ReaderMessage::fetch, {bytes_of(digest)}); },
      [&](const std::map<Sha256, std::string>& assets) { return upload(worker, assets); }};
  try {
    return inspect_scene(request, start.limits, images, hooks);
  } catch (const std::bad_alloc&) {
    return reader_out_of_memory(start.memory_bytes);
    // a library may throw anything for malformed files
  } catch (const std::exception& error) {
    return internal_error("the scene cannot be read: {}", error.what());
  }
}

}  // namespace

Status reader_out_of_memory(std::uint64_t memory_bytes) {
  return resource_exhausted(
      "reading the scene takes more than {} of memory, which its worker allows by --scene-gib: `lightmill submit` reads "
      "it on your machine",
      human_bytes(memory_bytes));
}

int run_scene_reader() {
  int type = 0;
  socklen_t size = sizeof(type);
  if (::getsockopt(STDIN_FILENO, SOL_SOCKET, SO_TYPE, &type, &size) != 0 || type != SOCK_STREAM) {
    std::cerr << "lightmill-worker: " << kSceneReaderOption << " is only for workers, which start it\n";
    return 2;
  }
  std::uint64_t most_bytes = kMaxStartBytes;
  ReaderStart start;
  ReaderSocket first(Descriptor(::dup(STDIN_FILENO)), most_bytes);
  const Result<ReaderSocket::Received> received = first.receive();
  if (!received.ok() || !received->bytes.ok() || received->bytes->size() < sizeof(start)) {
    return 1;  // the worker is gone
  }
  std::memcpy(&start, received->bytes->data(), sizeof(start));
  set_limits(start);
  ReaderSocket worker(Descriptor(::dup(STDIN_FILENO)), start.limits.bytes);
  const Result<Inspection> found = read(worker, start, std::string_view(*received->bytes).substr(sizeof(start)));
  const Status sent = found.ok() ? worker.send(ReaderMessage::report, {pack_inspection(*found)})
                                 : worker.send_error(ReaderMessage::report, found.status());
  return sent.ok() ? 0 : 1;
}

}  // namespace lightmill

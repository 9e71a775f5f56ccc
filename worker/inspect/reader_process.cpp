#include "worker/inspect/reader_process.h"

#include <sys/socket.h>
#include <sys/wait.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <set>

#include "common/base/child_program.h"
#include "common/wire/inspection_bytes.h"
#include "common/wire/limits.h"
#include "worker/inspect/reader_socket.h"
#include "worker/inspect/scene_reader.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kShare = 3;                            ///< of --scene-gib
constexpr std::uint64_t kMinMemory = std::uint64_t{64} << 20;  ///< for libraries and small scenes

/// Kills the process at its end.
class ReaderProcess {
 public:
  explicit ReaderProcess(pid_t pid) : pid_(pid) {}
  ReaderProcess(const ReaderProcess&) = delete;
  ReaderProcess& operator=(const ReaderProcess&) = delete;
  ~ReaderProcess() { end(); }

  /// Kills the process unless it has ended. Returns its status as waitpid does.
  int end() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);  // no effect on a process that has begun to end
      while (::waitpid(pid_, &status_, 0) < 0 && errno == EINTR) {
      }
      pid_ = 0;
    }
    return status_;
  }

 private:
  pid_t pid_;
  int status_ = 0;
};

/// The error of a process that ended without a report.
Status early_end(int status, const ReaderOptions& options, std::uint64_t memory_bytes) {
  if (WIFEXITED(status) && WEXITSTATUS(status) == kReaderOutOfMemory) {
    return reader_out_of_memory(memory_bytes);
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
    return make_error(StatusCode::kDeadlineExceeded, "reading the scene takes more than {} s", options.cpu_seconds);
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL) {
    return resource_exhausted(
        "the process that read the scene was killed, perhaps because the machine has no memory left: `lightmill submit` "
        "reads it on your machine");
  }
  return internal_error(
      "the process that read the scene ended early ({}): `lightmill check` reads it on your machine, and may name the file",
      end_text(status));
}

/// Serves one reader.
class Server {
 public:
  Server(ReaderSocket& reader, const InspectionRequest& request, const ReaderHooks& hooks)
      : reader_(reader), hooks_(hooks) {
    for (const InspectionRequest::File& file : request.files) {
      files_.insert(file.digest);
    }
  }

  Result<Inspection> run() {
    for (;;) {
      LM_ASSIGN_OR_RETURN(const ReaderSocket::Received received, reader_.receive());
      LM_RETURN_IF_ERROR(received.bytes.status());  // only reports are errors
      const std::string_view bytes = *received.bytes;
      switch (received.message) {
        case ReaderMessage::fetch:
          LM_RETURN_IF_ERROR(fetch(bytes));
          break;
        case ReaderMessage::offer:
          LM_RETURN_IF_ERROR(offer(bytes));
          break;
        case ReaderMessage::asset:
          LM_RETURN_IF_ERROR(store(bytes));
          break;
        case ReaderMessage::report:
          return unpack_inspection(bytes);
        default:
          return unexpected();
      }
    }
  }

 private:
  static Status unexpected() { return internal_error("the scene reader sent an unexpected message"); }

  static Sha256 digest_at(std::string_view bytes, std::size_t at) {
    Sha256 digest;
    std::memcpy(&digest, bytes.data() + at, sizeof(digest));
    return digest;
  }

  Status fetch(std::string_view bytes) {
    if (bytes.size() != sizeof(Sha256) || !files_.contains(digest_at(bytes, 0))) {
      return unexpected();
    }
    const Result<std::string> file = hooks_.fetch(digest_at(bytes, 0));
    return file.ok() ? reader_.send(ReaderMessage::reply, {*file})
                     : reader_.send_error(ReaderMessage::reply, file.status());
  }

  Status offer(std::string_view bytes) {
    if (bytes.size() % sizeof(Sha256) != 0 || bytes.size() / sizeof(Sha256) > kMaxAssets) {
      return unexpected();
    }
    std::vector<Sha256> digests(bytes.size() / sizeof(Sha256));
    if (!bytes.empty()) {  // memcpy takes no null pointer
      std::memcpy(digests.data(), bytes.data(), bytes.size());
    }
    LM_ASSIGN_OR_RETURN(const std::vector<Sha256> missing, hooks_.uploads.missing(digests));
    return reader_.send(ReaderMessage::reply, {std::string_view(reinterpret_cast<const char*>(missing.data()),
                                                                missing.size() * sizeof(Sha256))});
  }

  Status store(std::string_view bytes) {
    if (bytes.size() < sizeof(Sha256)) {
      return unexpected();
    }
    const Sha256 digest = digest_at(bytes, 0);
    LM_RETURN_IF_ERROR(with_context(hooks_.uploads.upload(digest, as_byte_view(bytes.substr(sizeof(digest)))),
                                    "asset " + digest.hex()));
    return reader_.send(ReaderMessage::reply, {});
  }

  ReaderSocket& reader_;
  const ReaderHooks& hooks_;
  std::set<Sha256> files_;
};

}  // namespace

std::uint64_t reader_memory(const SceneLimits& limits) {
  return kMinMemory + limits.bytes / kShare;
}

Result<Inspection> inspect_in_reader(const InspectionRequest& request, const SceneLimits& limits,
                                     const ReaderOptions& options, const ReaderHooks& hooks) {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    return resource_exhausted("cannot create a socket for the scene reader: {}", std::strerror(errno));
  }
  Descriptor own(ends[0]), childs(ends[1]);
  LM_ASSIGN_OR_RETURN(
      const pid_t pid,
      with_context(start_child({.path = options.program, .option = kSceneReaderOption, .input = childs.number()}),
                   "cannot read scenes"));
  childs.close();
  ReaderProcess process(pid);
  const std::uint64_t memory_bytes = reader_memory(limits);
  ReaderSocket reader(std::move(own), memory_bytes, hooks.may_continue);
  const std::string decoder = options.decoder.program.string();
  const ReaderStart start{limits,
                          memory_bytes,
                          options.cpu_seconds,
                          options.decoder.time_limit.count(),
                          options.decoder.unsandboxed ? 1u : 0u,
                          static_cast<std::uint32_t>(decoder.size())};
  const Status started = reader.send(
      ReaderMessage::start, {{reinterpret_cast<const char*>(&start), sizeof(start)}, decoder, pack_request(request)});
  Result<Inspection> found = started.ok() ? Server(reader, request, hooks).run() : Result<Inspection>(started);
  return reader.closed() ? Result<Inspection>(early_end(process.end(), options, memory_bytes)) : std::move(found);
}

}  // namespace lightmill

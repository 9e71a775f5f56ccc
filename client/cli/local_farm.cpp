#include "client/cli/local_farm.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <csignal>

#include "common/base/file.h"
#include "common/image/decoder/decoder_protocol.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kFolderPrefix =
    "lightmill-farm-";  // then the client's process id, a dash, and random letters
constexpr Duration kStartTimeout = std::chrono::seconds(20);
constexpr Duration kStartPoll = std::chrono::milliseconds(5);
constexpr std::size_t kLogTail = 2000;  // bytes

fs::path temporary_root() {
  std::error_code error;
  const fs::path root = fs::temp_directory_path(error);
  return error ? fs::path("/tmp") : root;
}

/// Whether this is the folder of a local farm whose client has ended.
bool is_abandoned(const fs::path& path) {
  const std::string name = path.filename().string();
  struct stat info {};
  if (!name.starts_with(kFolderPrefix) || ::lstat(path.c_str(), &info) != 0 || !S_ISDIR(info.st_mode) ||
      info.st_uid != ::geteuid()) {
    return false;
  }
  pid_t pid = 0;
  const char* digits = name.data() + kFolderPrefix.size();
  const auto parsed = std::from_chars(digits, name.data() + name.size(), pid);
  return parsed.ec == std::errc() && pid > 0 && ::kill(pid, 0) != 0 && errno == ESRCH;
}

void remove_abandoned() {
  std::error_code error;
  for (fs::directory_iterator it(temporary_root(), error), end; !error && it != end; it.increment(error)) {
    if (is_abandoned(it->path())) {
      std::error_code ignored;  // the next farm tries again
      fs::remove_all(it->path(), ignored);
    }
  }
}

Result<fs::path> make_folder() {
  std::string name = (temporary_root() / fmt::format("{}{}-XXXXXX", kFolderPrefix, ::getpid())).string();
  if (::mkdtemp(name.data()) == nullptr) {
    return failed_precondition(
        "cannot create a folder for a local farm, {}: {}. Set TMPDIR to a folder that you can write to", name,
        std::strerror(errno));
  }
  return fs::path(name);
}

std::string log_tail(const fs::path& path) {
  const Result<std::string> text = read_file(path);
  if (!text.ok() || text->empty()) {
    return "(its log is empty)";
  }
  return text->substr(text->size() - std::min(text->size(), kLogTail));
}

}  // namespace

Result<std::unique_ptr<LocalFarm>> LocalFarm::start(Signals& signals, const LocalFarmOptions& options) {
  remove_abandoned();
  std::unique_ptr<LocalFarm> farm(new LocalFarm);
  LM_RETURN_IF_ERROR(farm->launch(signals, options));
  return farm;
}

Status LocalFarm::launch(Signals& signals, const LocalFarmOptions& options) {
  LM_ASSIGN_OR_RETURN(folder_, make_folder());
  const fs::path programs = own_folder();
  const fs::path port_file = folder_ / "port";
  LM_ASSIGN_OR_RETURN(ChildProcess server, ChildProcess::start({(programs / "lightmill-server").string(), "--data",
                                                                (folder_ / "data").string(), "--listen", "127.0.0.1:0",
                                                                "--port-file", port_file.string()},
                                                               folder_ / "server.log"));
  server_.emplace(std::move(server));
  const auto until = std::chrono::steady_clock::now() + kStartTimeout;
  std::string port;
  while (port.empty()) {
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
    LM_RETURN_IF_ERROR(health());
    if (std::chrono::steady_clock::now() > until) {
      return internal_error("the local coordinator did not start within {} s. The last lines of its log:\n{}",
                            to_seconds(kStartTimeout), log_tail(folder_ / "server.log"));
    }
    signals.sleep(kStartPoll);
    port = read_file(port_file).value_or("");  // if it is missing, it is read again
    port.erase(port.find_last_not_of(" \r\n") + 1);
  }
  address_ = "127.0.0.1:" + port;
  std::vector<std::string> command{(programs / "lightmill-worker").string(), "--server", address_, "--name", "local"};
  if (options.threads > 0) {
    command.insert(command.end(), {"--threads", std::to_string(options.threads)});
  }
  if (options.unsandboxed_images) {
    command.emplace_back(kUnsandboxedImages);
  }
  LM_ASSIGN_OR_RETURN(ChildProcess worker, ChildProcess::start(command, folder_ / "worker.log"));
  worker_.emplace(std::move(worker));
  return ok_status();
}

Status LocalFarm::health() {
  if (const auto end = server_ ? server_->ended() : std::nullopt) {
    return internal_error("the local coordinator stopped ({}). The last lines of its log:\n{}", *end,
                          log_tail(folder_ / "server.log"));
  }
  if (const auto end = worker_ ? worker_->ended() : std::nullopt) {
    return internal_error("the local worker stopped ({}). The last lines of its log:\n{}", *end,
                          log_tail(folder_ / "worker.log"));
  }
  return ok_status();
}

LocalFarm::~LocalFarm() {
  worker_.reset();
  server_.reset();
  if (!folder_.empty()) {
    std::error_code ignored;  // the next farm tries again
    fs::remove_all(folder_, ignored);
  }
}

}  // namespace lightmill::cli

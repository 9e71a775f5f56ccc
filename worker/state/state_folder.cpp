#include "worker/state/state_folder.h"

#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

#include "common/base/file.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxWorkers = 4'096;
constexpr std::uint64_t kMaxTokenFileBytes = 4'096;

/// In a shared folder such as /var/tmp, another user may have created it first.
bool is_own(const fs::path& folder) {
  struct stat info {};
  return ::lstat(folder.c_str(), &info) == 0 && S_ISDIR(info.st_mode) && info.st_uid == ::geteuid() &&
         (info.st_mode & S_IWOTH) == 0;
}

}  // namespace

Result<StateFolder> StateFolder::take(const fs::path& root) {
  for (int number = 1; number <= kMaxWorkers; ++number) {
    const fs::path path = root / std::to_string(number);
    std::error_code error;
    if (fs::create_directories(path, error)) {
      fs::permissions(path, fs::perms::owner_all, error);
    }
    if (error) {
      return make_error(StatusCode::kPermissionDenied,
                        "cannot create the state folder {}: {}. Give another with --state", path.string(),
                        error.message());
    }
    if (!is_own(path)) {
      return failed_precondition(
          "the state folder {} belongs to another user, or everyone may write to it. Give another with --state",
          path.string());
    }
    Result<FileLock> lock = FileLock::acquire(path / "lock", "in use");
    if (lock.ok()) {
      return StateFolder(path, *std::move(lock));
    }
    if (lock.status().code() != StatusCode::kFailedPrecondition) {
      return make_error(lock.status().code(), "{}. Give another state folder with --state", message_of(lock.status()));
    }
  }
  return resource_exhausted("{} workers have a folder in {}, which is the limit: give another with --state",
                            kMaxWorkers, root.string());
}

bool StateFolder::has_token() const {
  std::error_code error;
  return fs::exists(token_file(), error);
}

Result<NewToken> StateFolder::pending_token() {
  if (const Result<std::string> kept = read_file(pending_file(), kMaxTokenFileBytes); kept.ok()) {
    if (Result<NewToken> token = token_of(kept->substr(0, kept->find('\n'))); token.ok()) {
      return token;
    }
  }
  LM_ASSIGN_OR_RETURN(NewToken token, make_token());
  LM_RETURN_IF_ERROR(write_secret_file(pending_file(), as_byte_view(token.text + "\n"), true));
  return token;
}

Status StateFolder::commit_pending_token() {
  std::error_code error;
  fs::rename(pending_file(), token_file(), error);
  if (error) {
    return unavailable("cannot write {}: {}", token_file().string(), error.message());
  }
  return sync_folder_of(token_file());
}

Result<fs::path> default_state_root() {
  if (const char* xdg = std::getenv("XDG_STATE_HOME"); xdg != nullptr && *xdg == '/') {
    return fs::path(xdg) / "lightmill-worker";
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return fs::path(home) / ".local" / "state" / "lightmill-worker";
  }
  return failed_precondition("no folder for the worker's state: HOME is not set. Give one with --state");
}

}  // namespace lightmill

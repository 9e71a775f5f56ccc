// Persistent state of a worker: its token.
#pragma once

#include <filesystem>

#include "common/base/file_lock.h"
#include "common/base/status.h"
#include "common/security/token.h"

namespace lightmill {

/// A folder that one running worker uses exclusively. Not thread-safe.
class StateFolder {
 public:
  /// Takes the first of ROOT/1, ROOT/2, … that no running worker has, and creates it if it does not exist. So each
  /// worker that shares ROOT has its own token, and finds it again. Errors name the folder.
  static Result<StateFolder> take(const std::filesystem::path& root);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path token_file() const { return path_ / "token"; }
  bool has_token() const;

  /// The token that the worker requests from its farm. It is kept until the farm confirms it. So a request that is
  /// repeated after a lost reply is the same.
  Result<NewToken> pending_token();
  /// The farm has confirmed the requested token. It replaces the old one.
  Status commit_pending_token();

 private:
  StateFolder(std::filesystem::path path, FileLock lock) : path_(std::move(path)), lock_(std::move(lock)) {}
  std::filesystem::path pending_file() const { return path_ / "token.asked"; }

  std::filesystem::path path_;
  FileLock lock_;
};

/// $XDG_STATE_HOME/lightmill-worker or ~/.local/state/lightmill-worker. FAILED_PRECONDITION if neither variable is set.
Result<std::filesystem::path> default_state_root();

}  // namespace lightmill

// What a worker keeps from one start to the next: the token by which its farm knows it.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/file_lock.h"
#include "common/base/status.h"
#include "common/security/token.h"

namespace lightmill {

/// A folder that one worker has for itself while it runs. Not thread-safe.
class StateFolder {
 public:
  /// Takes the first of ROOT/1, ROOT/2 and so on that no running worker has; made if need be. So workers that share
  /// ROOT have a token each, and find it again. Errors name the folder.
  static Result<StateFolder> take(const std::filesystem::path& root);

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path token_file() const { return path_ / "token"; }
  bool has_token() const;

  /// The token that the worker asks its farm for. It is kept until the farm has said yes, so that a request whose
  /// answer was lost is repeated and is not another one.
  Result<NewToken> asked_token();
  /// The farm knows the token that was asked for: it takes the place of the one before.
  Status keep_asked_token();

 private:
  StateFolder(std::filesystem::path path, FileLock lock) : path_(std::move(path)), lock_(std::move(lock)) {}
  std::filesystem::path asked_file() const { return path_ / "token.asked"; }

  std::filesystem::path path_;
  FileLock lock_;
};

/// $XDG_STATE_HOME/lightmill-worker, or ~/.local/state/lightmill-worker. FAILED_PRECONDITION without both.
Result<std::filesystem::path> default_state_root();

}  // namespace lightmill

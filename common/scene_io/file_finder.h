// Finder of files by names that were written on another machine.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>

#include "common/scene_io/scene_files.h"

namespace lightmill {

/// Remembers the folders in which it has searched, so each is listed once. Not thread-safe.
class FileFinder {
 public:
  /// `files` must outlive it.
  explicit FileFinder(const SceneFiles& files) : files_(files) {}

  /// The name, below `folder`, of the file that `written` means. The first of these that exists: the file itself; the
  /// one with slashes instead of backslashes, in any case; the one in `folder` with its last part as name, in any case.
  std::optional<std::string> find(const std::filesystem::path& folder, const std::string& written);

 private:
  /// The entry of a folder with this name in any case. Empty if there is none.
  std::string entry(const std::filesystem::path& folder, const std::string& name);

  const SceneFiles& files_;
  std::map<std::string, std::map<std::string, std::string>> folders_;  ///< entries by name in lower case
};

/// A file that a scene file names.
struct SourceFile {
  std::string name;  ///< below the scene file's folder. It may differ from the one that was asked for.
  std::string bytes;
};
/// Reads a file that a scene file names by a relative path. An error says why it failed, NOT_FOUND that there is none.
using FileSource = std::function<Result<SourceFile>(const std::string& relative_path)>;
/// Reads the files that are found from this folder, each of at most `limit_bytes`. `files` must outlive it.
FileSource files_below(const std::filesystem::path& folder, const SceneFiles& files, std::uint64_t limit_bytes);

/// The same files. Fails once they have more bytes in all, each counted as often as it is read.
FileSource at_most(std::uint64_t bytes, FileSource files);

}  // namespace lightmill

// Finder of files by names that were written on another machine.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "common/scene_io/scene_files.h"

namespace lightmill {

/// Remembers the folders in which it has searched, so each is listed once. Not thread-safe.
class FileFinder {
 public:
  /// `files` must outlive it.
  explicit FileFinder(const SceneFiles& files) : files_(files) {}

  /// The name, below `folder`, of the file that `written` means: the file itself; else the one with slashes instead of
  /// backslashes, in any case; else the one in `folder` that has its last part as its name, in any case.
  std::optional<std::string> find(const std::filesystem::path& folder, const std::string& written);

 private:
  /// The entry of a folder with this name in any case. Empty if there is none.
  std::string entry(const std::filesystem::path& folder, const std::string& name);

  const SceneFiles& files_;
  std::map<std::string, std::map<std::string, std::string>> folders_;  ///< entries by name in lower case
};

}  // namespace lightmill

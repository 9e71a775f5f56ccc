// The source of a scene's files: the disk, or a given set.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// Every file of a scene is read through this, so other files cannot be read.
class SceneFiles {
 public:
  virtual ~SceneFiles() = default;
  /// The whole file. Errors name the path. Fails if it is larger than `limit_bytes`.
  virtual Result<std::string> read(const std::filesystem::path& path, std::uint64_t limit_bytes) const = 0;
  virtual bool exists(const std::filesystem::path& path) const = 0;
  /// Whether it is a regular file, not a folder or device.
  virtual bool is_file(const std::filesystem::path& path) const = 0;
  /// The names of the files and folders in a folder, sorted. None if it cannot be read.
  virtual std::set<std::string> names(const std::filesystem::path& folder) const = 0;
};

/// All files that this process may read.
const SceneFiles& files_on_disk();

/// A set of files with names. No folder, link or absolute path leads to another file.
class UploadedFiles final : public SceneFiles {
 public:
  /// Gets the bytes of the file with this digest. It may take long.
  using Fetch = std::function<Result<std::string>(const Sha256& digest)>;
  static constexpr std::size_t kMaxPathBytes = 4096;

  explicit UploadedFiles(Fetch fetch) : fetch_(std::move(fetch)) {}

  /// INVALID_ARGUMENT unless the path is relative, stays below its root, and is new.
  Status add(const std::string& path, const Sha256& digest);

  /// NOT_FOUND if the file is not in the set. Else the errors of the fetch.
  Result<std::string> read(const std::filesystem::path& path, std::uint64_t limit_bytes) const override;
  bool exists(const std::filesystem::path& path) const override { return is_file(path); }
  bool is_file(const std::filesystem::path& path) const override;
  std::set<std::string> names(const std::filesystem::path& folder) const override;

 private:
  Fetch fetch_;
  std::map<std::string, Sha256> files_;  ///< by path in normal form
};

}  // namespace lightmill

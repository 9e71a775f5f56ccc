// Where the files of a scene are read from: the disk, or a set that somebody has handed over.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// Every file that a scene names is read through this, so what it does not have cannot be read.
class SceneFiles {
 public:
  virtual ~SceneFiles() = default;
  /// The whole file; errors name the path. Fails on files over `limit_bytes`.
  virtual Result<std::string> read(const std::filesystem::path& path, std::uint64_t limit_bytes) const = 0;
  virtual bool exists(const std::filesystem::path& path) const = 0;
  /// It is no folder or device.
  virtual bool is_file(const std::filesystem::path& path) const = 0;
};

/// All that this process may read.
const SceneFiles& files_on_disk();

/// Files that were handed over by name, and nothing else: no folder, link or absolute path leads to another one.
class HandedFiles final : public SceneFiles {
 public:
  /// Gets the bytes of the file with this digest; may take long.
  using Fetch = std::function<Result<std::string>(const Sha256& digest)>;
  static constexpr std::size_t kMostPathBytes = 4096;

  explicit HandedFiles(Fetch fetch) : fetch_(std::move(fetch)) {}

  /// INVALID_ARGUMENT unless the path is relative, leads nowhere above its root, and is the first of its name.
  Status add(const std::string& path, const Sha256& digest);

  /// NOT_FOUND says that the file is not among those that came along; else the errors of the fetch.
  Result<std::string> read(const std::filesystem::path& path, std::uint64_t limit_bytes) const override;
  bool exists(const std::filesystem::path& path) const override { return is_file(path); }
  bool is_file(const std::filesystem::path& path) const override;

 private:
  Fetch fetch_;
  std::map<std::string, Sha256> files_;  ///< by their paths in normal form
};

}  // namespace lightmill

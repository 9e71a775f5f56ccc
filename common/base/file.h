// Files that are never half written, reading whole ones, and where the program lies.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// The whole file; errors name the path. Fails on files over `limit_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t limit_bytes = std::uint64_t{4} << 30);

/// Whether write_file_atomically could begin: creates and removes its temporary file. `path` itself is not touched.
/// Errors of both name `path`.
Status check_can_write(const std::filesystem::path& path);

/// As write_file_atomically, for what nobody else may read (mode 0600). ALREADY_EXISTS, and nothing is touched, if
/// there is such a file already, unless `replace`.
Status write_secret_file(const std::filesystem::path& path, ByteView bytes, bool replace);

/// Writes to a temporary name beside `path`, flushes to disk and renames: readers see the old file or the new one.
Status write_file_atomically(const std::filesystem::path& path, ByteView bytes);

/// Makes the name of this file last through a power failure, where its file system can do that.
void sync_folder_of(const std::filesystem::path& path);

/// The folder of the running program.
std::filesystem::path own_folder();

}  // namespace lightmill

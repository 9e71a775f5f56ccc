// Whole files: reading them, writing them atomically. Also the program's folder.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// The whole file. Errors name the path. RESOURCE_EXHAUSTED if it is larger than `limit_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t limit_bytes = std::uint64_t{4} << 30);

/// Whether write_file_atomically can create its temporary file. It creates and removes one, and does not touch `path`.
/// Errors of both name `path`.
Status check_can_write(const std::filesystem::path& path);

/// Like write_file_atomically, for a file that only its owner can read (mode 0600). ALREADY_EXISTS if the file exists
/// and `replace` is false. The file is not touched then.
Status write_secret_file(const std::filesystem::path& path, ByteView bytes, bool replace);

/// Writes a temporary file beside `path`, flushes it to disk and renames it. Readers see the old file or the new one.
Status write_file_atomically(const std::filesystem::path& path, ByteView bytes);

/// Flushes a file's bytes to disk.
Status sync_file(const std::filesystem::path& path);

/// Flushes the folder's entry of this file to disk, so that the name survives a power failure. Not every file system
/// can do that.
void sync_folder_of(const std::filesystem::path& path);

/// Gives an open file of root to its folder's owner, if this process may. Root may work in the folder of a service.
void give_to_owner_of_folder(int file, const std::filesystem::path& path);

/// The folder of the running program.
std::filesystem::path own_folder();

}  // namespace lightmill

// Functions that read whole files and write them atomically.
#pragma once

#include <filesystem>
#include <string>

#include "common/base/digest.h"
#include "common/base/status.h"

namespace lightmill {

/// The whole file. Errors name the path. RESOURCE_EXHAUSTED if it is larger than `limit_bytes`.
Result<std::string> read_file(const std::filesystem::path& path, std::uint64_t limit_bytes = std::uint64_t{4} << 30);

/// Whether write_file_atomically can create its temporary file. It creates one and removes it, and does not touch
/// `path`. Errors of both functions name `path`.
Status check_can_write(const std::filesystem::path& path);

/// Like write_file_atomically, for a file that only its owner can read (mode 0600). ALREADY_EXISTS if the file exists
/// and `replace` is false. The file is not touched then.
Status write_secret_file(const std::filesystem::path& path, ByteView bytes, bool replace);

/// Writes a temporary file beside `path`, flushes it to disk and renames it. Readers see the old file or the new one.
Status write_file_atomically(const std::filesystem::path& path, ByteView bytes);

/// Flushes a file's bytes to disk.
Status sync_file(const std::filesystem::path& path);

/// Flushes the folder's entry of this file to disk, so that the name survives a power failure. OK where that is not
/// possible: some file systems cannot flush folders, and this process may lack the right to read the folder.
Status sync_folder_of(const std::filesystem::path& path);

/// Makes the owner of the folder the owner of this open file, if root owns it. Otherwise a service could not use the
/// files that root creates in its folder. Does nothing if this process lacks the right.
void give_to_owner_of_folder(int file, const std::filesystem::path& path);

/// The folder of the running program.
std::filesystem::path own_folder();

}  // namespace lightmill

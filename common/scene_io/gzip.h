// Unpacked gzip files.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "common/scene_io/file_finder.h"

namespace lightmill {

/// The content of a gzip file (RFC 1952), of all its members. Fails if it has more than `limit_bytes`. Errors begin with
/// the file's name.
Result<std::string> gunzip(std::string_view bytes, const std::string& file_name, std::uint64_t limit_bytes);

/// The same files. Those that end with .gz are unpacked. Fails once they have more than `bytes` in all.
FileSource unpacked(std::uint64_t bytes, FileSource files);

}  // namespace lightmill

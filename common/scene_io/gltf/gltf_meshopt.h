// Decoder of glTF buffer views that are compressed with meshoptimizer (EXT_meshopt_compression).
#pragma once

#include <string>

#include "common/scene_io/gltf/json_node.h"

namespace lightmill {

inline constexpr std::string_view kMeshopt = "EXT_meshopt_compression";
/// Bytes that all decoded views of a file may have together.
inline constexpr std::uint64_t kMaxMeshoptBytes = std::uint64_t{4} << 30;

/// The decoded bytes of a view. `extension` says how `bytes` are encoded. `budget`: how many bytes may still be
/// decoded; it is reduced. Empty after an error.
std::string decode_meshopt(const JsonNode& extension, std::string_view bytes, std::uint64_t& budget);

}  // namespace lightmill

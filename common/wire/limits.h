// Limits of messages. Larger ones are refused before memory is allocated for them.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/base/text.h"

namespace lightmill {

inline constexpr std::size_t kMaxSceneBytes = std::size_t{16} << 20;  ///< of a packed scene document
inline constexpr std::size_t kMaxInspectedEntries = 100'000;          ///< of a scene that a worker reads for a page
inline constexpr std::size_t kMaxAssets = 10'000;                     ///< of one scene
inline constexpr std::size_t kMaxLayers = 64;                         ///< of one film
inline constexpr std::size_t kMaxChannels = 96;                       ///< of all layers of one film together
inline constexpr std::size_t kMaxNodeValues = 2 * kMaxChannels;       ///< per pixel, whatever the layers are
inline constexpr std::size_t kMaxUnitTiles = std::size_t{1} << 20;    ///< tiles of a film of 65536² pixels
inline constexpr std::size_t kMaxListedLeases = 10'000;               ///< in one hello, heartbeat or cancel
inline constexpr std::size_t kMaxListedNodes = 100'000;               ///< in one acknowledgement
inline constexpr std::size_t kMaxWireNameBytes = 1024;                ///< of names, hosts and versions
inline constexpr std::size_t kMaxMethodNotes = 16;                    ///< reasons, notices or candidates of one job
inline constexpr std::size_t kMaxSceneFiles = 10'000;                 ///< of one inspection
inline constexpr std::size_t kMaxPathBytes = 4096;                    ///< of one of them
inline constexpr std::size_t kMaxPathsBytes = std::size_t{2} << 20;   ///< of all of them
inline constexpr std::size_t kMaxInspectionRows = 2'000;              ///< notices, facts, methods or cameras of one
inline constexpr std::size_t kMaxReasonBytes = 64 * 1024;  ///< of texts of the coordinator, and of readers' errors
inline constexpr std::size_t kMaxRefusalBytes = 1024;      ///< of a worker's reason not to render a job

/// INVALID_ARGUMENT unless `text` has at most `limit` bytes.
inline Status check_length(std::string_view field, std::string_view text, std::size_t limit) {
  if (text.size() > limit) {
    return invalid_argument("{}: {} bytes are more than the limit of {}", field, text.size(), limit);
  }
  return ok_status();
}

/// INVALID_ARGUMENT unless a list of `count` entries is within `limit`.
inline Status check_count(std::string_view field, int count, std::size_t limit) {
  if (static_cast<std::size_t>(count) > limit) {
    return invalid_argument("{}: {} entries are more than the limit of {}", field, count, limit);
  }
  return ok_status();
}

/// Reads a repeated field of strings: at most kMaxMethodNotes, of at most kMaxReasonBytes each.
template <class Repeated>
Result<std::vector<std::string>> texts_from_wire(std::string_view field, const Repeated& texts) {
  if (static_cast<std::size_t>(texts.size()) > kMaxMethodNotes) {
    return invalid_argument("{}: {} are more than the limit of {}", field, texts.size(), kMaxMethodNotes);
  }
  for (const std::string& text : texts) {
    LM_RETURN_IF_ERROR(check_length(field, text, kMaxReasonBytes));
  }
  return std::vector<std::string>(texts.begin(), texts.end());
}

/// The sentence as valid text of limited length. It may quote files with any bytes. Protobuf refuses a whole message
/// with an invalid string, and the stream would end.
inline std::string sentence(std::string_view text, std::size_t limit = kMaxReasonBytes) {
  return cut_text(printable(text, true), limit - std::string_view("…").size());
}

}  // namespace lightmill

// Strong ids: a JobId is not a LeaseId, though both are numbers.
#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <functional>

namespace lightmill {

template <class Tag, class Value = std::uint64_t>
struct StrongId {
  Value value{};
  friend auto operator<=>(const StrongId&, const StrongId&) = default;
};

using JobId = StrongId<struct JobTag>;                   ///< Counts up from 1 in one data folder.
using LeaseId = StrongId<struct LeaseTag>;               ///< Unique within one data folder: epoch·2^32 + count.
using SessionId = StrongId<struct SessionTag>;           ///< One connection of one worker; unique within an epoch.
using TileId = StrongId<struct TileTag, std::uint32_t>;  ///< Index into a TileGrid, row by row.

}  // namespace lightmill

template <class Tag, class Value>
struct std::hash<lightmill::StrongId<Tag, Value>> {
  std::size_t operator()(const lightmill::StrongId<Tag, Value>& id) const noexcept {
    return std::hash<Value>{}(id.value);
  }
};

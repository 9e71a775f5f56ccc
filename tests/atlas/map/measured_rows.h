// Rows of the map that are measured already, in files: a long map goes on where it was interrupted. They know the
// version of the renderer, not that of the atlas: who changes how cases are judged empties the folder.
#pragma once

#include <filesystem>
#include <optional>

#include "tests/atlas/map/atlas_map.h"

namespace lightmill::test {

class MeasuredRows {
 public:
  /// In `folder`, which is there, a file a row.
  explicit MeasuredRows(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// The row of the same case with the same settings by the same version of the renderer, numbers and pictures; nothing
  /// if it is not there or cannot be read.
  std::optional<AtlasRow> find(const AtlasCase& what, const AtlasSettings& settings) const;
  Status keep(const AtlasRow& row, const AtlasSettings& settings) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace lightmill::test

// Measured rows of the map, in files, so that a long map resumes after an interruption. They record the renderer's
// version, not the atlas'. Empty the folder when you change how cases are judged.
#pragma once

#include <filesystem>
#include <optional>

#include "tests/atlas/map/atlas_map.h"

namespace lightmill::test {

class MeasuredRows {
 public:
  /// Uses `folder`, which must exist. Each row is one file.
  explicit MeasuredRows(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// The row of the same case with the same settings and renderer version, with numbers and pictures. Nothing if its
  /// file is missing or unreadable.
  std::optional<AtlasRow> find(const AtlasCase& what, const AtlasSettings& settings) const;
  Status keep(const AtlasRow& row, const AtlasSettings& settings) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace lightmill::test

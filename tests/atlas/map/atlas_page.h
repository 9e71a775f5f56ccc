// The failure atlas' map as one self-contained HTML page, as CSV and as JSON. Pure functions.
#pragma once

#include <span>
#include <string>

#include "tests/atlas/map/atlas_map.h"

namespace lightmill::test {

/// Counts of one method's outcomes.
struct OutcomeCounts {
  int right = 0, slow = 0, alone = 0, vetoed = 0, wrong = 0;
};
OutcomeCounts count_outcomes(std::span<const AtlasRow> rows, const std::string& method);

/// A table of cases by methods, with pictures. Colours show outcomes. Cells have numbers, and more of them on hover.
std::string atlas_html(std::span<const AtlasRow> rows, const AtlasSettings& settings);
/// One line per cell, with a heading line.
std::string atlas_csv(std::span<const AtlasRow> rows);
std::string atlas_json(std::span<const AtlasRow> rows, const AtlasSettings& settings);

}  // namespace lightmill::test

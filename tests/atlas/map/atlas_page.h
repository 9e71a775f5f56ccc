// The failure atlas' map as one self-contained HTML page, as CSV and as JSON. Pure.
#pragma once

#include <span>
#include <string>

#include "tests/atlas/map/atlas_map.h"

namespace lightmill::test {

/// What one method's cells came to.
struct OutcomeCounts {
  int right = 0, slow = 0, alone = 0, vetoed = 0, wrong = 0;
};
OutcomeCounts count_outcomes(std::span<const AtlasRow> rows, const std::string& method);

/// A table of cases by methods: colours by outcome, numbers in the cells and more when pointed at, and pictures.
std::string atlas_html(std::span<const AtlasRow> rows, const AtlasSettings& settings);
/// A line a cell, with a head line.
std::string atlas_csv(std::span<const AtlasRow> rows);
std::string atlas_json(std::span<const AtlasRow> rows, const AtlasSettings& settings);

}  // namespace lightmill::test

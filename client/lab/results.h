// What was measured, as JSON lines and as CSV.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"
#include "common/image/error_metrics.h"

namespace lightmill::lab {

/// One picture: a scene by a method with a seed, at one level.
struct LabResult {
  std::string key;  ///< digest of all that decides it, the reference included: see docs/guide/lab.md
  std::string scene, method;
  std::uint64_t seed = 0;
  std::size_t level = 0;
  std::uint64_t samples = 0;  ///< per pixel
  double thread_seconds = 0;  ///< of the farm's threads, for all samples up to here
  double seconds = 0;         ///< during which it was being rendered
  PictureError error;         ///< against the reference
  double flip = 0;
  double stated = -1, stated_half_width = -1;  ///< relMSE as the job itself stated it; negative: it did not
  std::string film_hash;
};

/// Fills in the errors of a result. INVALID_ARGUMENT for pictures that cannot be compared.
Status compare(const RgbImage& picture, const RgbImage& reference, LabResult& result);

nlohmann::json to_json(const LabResult& result);

/// By key.
using ResultSet = std::map<std::string, LabResult>;

/// Reads what write_lines wrote; DATA_LOSS names the line. A last one that was cut off counts as not there.
Result<ResultSet> read_lines(std::string_view text);

/// One object a line: those of `order` first, in its order, then the others by key.
std::string write_lines(const ResultSet& results, const std::vector<std::string>& order);

/// With a head line; texts in quotes where they need them.
std::string to_csv(const std::vector<LabResult>& results);

}  // namespace lightmill::lab

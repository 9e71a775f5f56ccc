// Measurements, as JSON lines and as CSV.
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

/// The measurement of one picture: scene, method, seed and level.
struct LabResult {
  std::string key;  ///< digest of all that decides it, with the reference: see docs/guide/lab.md
  std::string scene, method;
  std::uint64_t seed = 0;
  std::size_t level = 0;
  std::uint64_t samples = 0;  ///< per pixel
  double thread_seconds = 0;  ///< of the farm's threads, for all samples so far
  double seconds = 0;         ///< wall-clock time of rendering
  PictureError error;         ///< against the reference
  double flip = 0;
  double stated = -1, stated_half_width = -1;  ///< the job's own relMSE; negative: unknown
  std::string film_hash;
};

/// Fills in the errors of a result. INVALID_ARGUMENT for pictures that cannot be compared.
Status compare(const RgbImage& picture, const RgbImage& reference, LabResult& result);

nlohmann::json to_json(const LabResult& result);

/// By key.
using ResultSet = std::map<std::string, LabResult>;

/// Reads what write_lines wrote. DATA_LOSS names the line. A last line that was cut off is ignored.
Result<ResultSet> read_lines(std::string_view text);

/// One object a line: those of `order` first, in this order, then the others by key.
std::string write_lines(const ResultSet& results, const std::vector<std::string>& order);

/// CSV with a header. Texts are quoted where needed.
std::string to_csv(const std::vector<LabResult>& results);

}  // namespace lightmill::lab

#include "tests/atlas/map/measured_rows.h"

#include <nlohmann/json.hpp>

#include "common/base/digest.h"
#include "common/base/file.h"
#include "common/farm/job.h"
#include "tests/support/paths.h"

namespace lightmill {
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(RgbImage, width, height, values)
}

namespace lightmill::test {

// Contents of a row's file, as CBOR.
NLOHMANN_JSON_SERIALIZE_ENUM(Outcome, {{Outcome::stopped, "stopped"},
                                       {Outcome::right, "right"},
                                       {Outcome::slow, "slow"},
                                       {Outcome::alone, "alone"},
                                       {Outcome::vetoed, "vetoed"},
                                       {Outcome::wrong, "wrong"}})
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(AtlasCell, method, outcome, reason, measured, mean, standard_error, z, energy,
                                   cpu_seconds, seconds_to_percent, non_finite, picture)

namespace {

using nlohmann::json;

/// Text of the case's document.
std::string text_of(const AtlasCase& what) {
  return what.document.ends_with(".json") ? read_file(source_file("scenes/" + what.document)).value() : what.document;
}

std::map<std::string, std::string> digests_of(const std::map<std::string, std::string>& files) {
  std::map<std::string, std::string> digests;
  for (const auto& [name, bytes] : files) {
    digests[name] = sha256(bytes).hex();
  }
  return digests;
}

/// A name made from everything that determines a row, except the files that documents in the folder scenes name.
std::string file_name(const AtlasCase& what, const AtlasSettings& settings) {
  const json from{what.subject,
                  what.name,
                  text_of(what),
                  digests_of(what.files),
                  what.exact.value_or(-1),
                  what.tolerance,
                  what.gathered,
                  what.unit,
                  {what.rect.x, what.rect.y, what.rect.width, what.rect.height},
                  what.max_bounces,
                  what.level,
                  what.seconds_to_percent,
                  what.refusal,
                  settings.methods,
                  settings.seeds,
                  settings.more_levels,
                  settings.measure_vetoed,
                  settings.retries,
                  kRendererVersion};
  return sha256(from.dump()).hex() + ".cbor";
}

}  // namespace

std::optional<AtlasRow> MeasuredRows::find(const AtlasCase& what, const AtlasSettings& settings) const {
  const auto bytes = read_file(folder_ / file_name(what, settings));
  if (!bytes.ok()) {
    return std::nullopt;
  }
  try {
    const json row = json::from_cbor(*bytes);
    return AtlasRow{what, what.exact.value_or(0), row.at("expected_from"), row.at("cells")};
  } catch (const json::exception&) {
    return std::nullopt;
  }
}

Status MeasuredRows::keep(const AtlasRow& row, const AtlasSettings& settings) const {
  const json kept{{"expected_from", row.expected_from}, {"cells", row.cells}};
  const std::vector<std::uint8_t> bytes = json::to_cbor(kept);
  return write_file_atomically(folder_ / file_name(row.what, settings), std::as_bytes(std::span(bytes)));
}

}  // namespace lightmill::test

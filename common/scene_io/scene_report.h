// Report on a scene before it is rendered: its contents, and the planner's facts.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "common/planner/scene_facts.h"
#include "common/scene_io/load.h"

namespace lightmill {

struct SceneReport {
  using Counts = std::map<std::string, std::size_t>;
  std::size_t triangles = 0, spheres = 0, planes = 0, emissive_objects = 0;
  std::size_t colored_objects = 0;  ///< whose vertices have colours
  Counts lights, materials;         ///< by kind
  std::uint64_t asset_bytes = 0;
  SceneFacts facts;
};

/// Also adds notices to the scene. Fails if a mesh is damaged.
Result<SceneReport> report_on(LoadedScene& loaded);

/// Rows of a table: a name, and its value.
using ReportRows = std::vector<std::vector<std::string>>;
ReportRows scene_rows(const LoadedScene& loaded, const SceneReport& report);
/// Rows for the planner's facts that matter.
ReportRows fact_rows(const SceneFacts& facts);

}  // namespace lightmill

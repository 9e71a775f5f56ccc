// What people should know of a scene before it is rendered: what is in it, and what that means for methods.
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
  Counts lights, materials;  ///< by kind
  std::uint64_t asset_bytes = 0;
  SceneFacts facts;
};

/// Adds what is to be noticed to the scene's notices. Fails if a mesh is damaged.
Result<SceneReport> report_on(LoadedScene& loaded);

/// Rows of a table: what, and what of it.
using ReportRows = std::vector<std::vector<std::string>>;
ReportRows scene_rows(const LoadedScene& loaded, const SceneReport& report);
/// What of the planner's facts is worth a row.
ReportRows fact_rows(const SceneFacts& facts);

}  // namespace lightmill

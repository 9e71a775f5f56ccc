// What `check` says of methods: the planner's facts, its verdicts, and what `auto` would choose.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "common/scene_io/scene_report.h"

namespace lightmill::cli {

nlohmann::json plan_json(const SceneFacts& facts);
/// Rows of a table: what, and what of it.
ReportRows plan_rows(const SceneFacts& facts);

}  // namespace lightmill::cli

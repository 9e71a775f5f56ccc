// The part of `check` about methods: the planner's facts, its verdicts, and the choice of `auto`.
#pragma once

#include <nlohmann/json_fwd.hpp>

#include "common/scene_io/scene_report.h"

namespace lightmill::cli {

nlohmann::json plan_json(const SceneFacts& facts);
/// Rows of a table: name and value.
ReportRows plan_rows(const SceneFacts& facts);

}  // namespace lightmill::cli

// What `check` says of methods: the planner's facts, its verdicts, and what `auto` would choose.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/planner/scene_facts.h"

namespace lightmill::cli {

nlohmann::json plan_json(const SceneFacts& facts);
/// Rows of a table: what, and what of it.
std::vector<std::vector<std::string>> plan_rows(const SceneFacts& facts);
/// What else a user should know before rendering.
std::vector<std::string> plan_notices(const SceneFacts& facts);

}  // namespace lightmill::cli

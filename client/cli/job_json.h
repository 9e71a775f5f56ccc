// The JSON form of jobs and workers, as --json prints it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "lightmill/v1/farm.pb.h"

namespace lightmill::cli {

/// All fields that the farm reports about a job. Unknown values are null.
nlohmann::json to_json(const v1::Job& job);
nlohmann::json to_json(const v1::Worker& worker);
/// The same. "notices" begin with those of the scene that was sent.
nlohmann::json to_json(const v1::Job& job, const std::vector<std::string>& scene_notices);

}  // namespace lightmill::cli

// What the farm did, as JSON: GET /api/v1/history, /api/v1/events and /api/v1/workers/NAME/history.
#pragma once

#include <functional>
#include <string_view>

#include "server/access/rights.h"
#include "server/web/farm_reply.h"

namespace lightmill {

/// Looks on the farm thread; what it gives back writes the answer, on any thread.
using LookBack = std::function<std::function<ApiReply()>(FarmLoop::Turn&)>;

/// Whether a path, behind /api/v1/, is one of these.
bool looks_back(std::string_view path);
/// Of events about jobs, those that the caller may see. INVALID_ARGUMENT.
Result<LookBack> look_back_at(std::string_view path, std::string_view query, const Identity& caller);

}  // namespace lightmill

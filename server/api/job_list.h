// Jobs as a list with pages, whichever way it is asked for.
#pragma once

#include "server/access/rights.h"
#include "server/api/farm_loop.h"

namespace lightmill::v1 {
class ListJobsResponse;
}

namespace lightmill {

/// Adds the newest `size` (at least 1) of the jobs that the caller may see, older than `before` (0: all), newest first;
/// and the token of the next page, if there is one.
void list_jobs(const FarmLoop::Turn& turn, const Identity& caller, int size, std::uint64_t before,
               v1::ListJobsResponse* out);

}  // namespace lightmill

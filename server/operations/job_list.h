// Jobs as a list with pages, whichever way it is asked for.
#pragma once

#include "server/access/rights.h"
#include "server/runtime/farm_loop.h"

namespace lightmill::v1 {
class ListJobsResponse;
}

namespace lightmill {

/// One page of such a list.
struct JobPage {
  int size = 0;              ///< at least 1
  std::uint64_t before = 0;  ///< older ones than this; 0: all
  bool unfinished = false;   ///< only those that have not ended
};

/// Adds the newest of the page's jobs that the caller may see, newest first; and the token of the next page, if there
/// is one.
void list_jobs(const FarmLoop::Turn& turn, const Identity& caller, const JobPage& page, v1::ListJobsResponse* out);

}  // namespace lightmill

#include "server/operations/job_list.h"

#include "common/wire/farm_messages.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill {

void list_jobs(const FarmLoop::Turn& turn, const Identity& caller, const JobPage& page, v1::ListJobsResponse* out) {
  JobFilter filter{.most = static_cast<std::size_t>(page.size) + 1,
                   .unfinished = page.unfinished,
                   .admits = [&](const std::string& owner) { return may_see_job(caller, owner); }};
  if (page.before > 0) {
    filter.before = JobId{page.before};
  }
  for (const JobStatus& job : turn.farm.jobs(turn.now, filter)) {
    if (out->jobs_size() == page.size) {
      out->set_next_page_token(std::to_string(out->jobs(page.size - 1).id()));
    } else {
      to_wire(job, out->add_jobs());
    }
  }
}

}  // namespace lightmill

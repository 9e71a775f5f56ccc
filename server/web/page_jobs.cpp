#include "server/web/page_jobs.h"

#include <utility>

#include "server/operations/operation.h"

namespace lightmill {
namespace {

/// Interval for repeating a failed deletion, for example while nothing can be stored.
constexpr Duration kTryInterval = std::chrono::seconds(1);
constexpr std::size_t kMaxPageNameBytes = 64;

bool are_same(const Call& a, const Call& b) {
  return a.caller.name == b.caller.name && a.caller.proof == b.caller.proof;
}

}  // namespace

PageJobs::PageJobs(OnWebThread on_web_thread, const Clock& clock, Discard discard)
    : on_web_thread_(std::move(on_web_thread)), clock_(clock), discard_(std::move(discard)) {}

Status PageJobs::connected(const std::string& page, const Call& call) {
  if (page.size() > kMaxPageNameBytes) {
    return invalid_argument("page: the name has {} bytes, the limit is {}", page.size(), kMaxPageNameBytes);
  }
  const auto [at, is_new] = pages_.try_emplace(page);
  if (is_new) {
    at->second.call = {call.caller, call.rpc, call.peer};
  }
  if (!are_same(at->second.call, call)) {
    return make_error(StatusCode::kPermissionDenied, "page: another caller uses this name");
  }
  ++at->second.connections;
  return ok_status();
}

void PageJobs::disconnected(const std::string& page) {
  const auto at = pages_.find(page);
  if (at == pages_.end() || --at->second.connections > 0) {
    return;
  }
  at->second.left_at = clock_.now();
  if (at->second.jobs.empty()) {
    pages_.erase(at);
  }
}

Status PageJobs::check(const std::string& page, const Call& call) const {
  const auto at = pages_.find(page);
  return at != pages_.end() && are_same(at->second.call, call)
             ? ok_status()
             : failed_precondition("the page for which this job is submitted has no connection: try again once it has");
}

std::function<void(JobId)> PageJobs::submission_callback(const std::string& page, const Call& call) {
  return [on_web_thread = on_web_thread_, weak = std::weak_ptr<PageJobs*>(self_), page, call](JobId job) {
    on_web_thread([weak, page, call, job] {
      if (const auto here = weak.lock()) {
        (*here)->add(page, call, job);
      }
    });
  };
}

void PageJobs::add(const std::string& page, const Call& call, JobId job) {
  if (const auto at = pages_.find(page); at != pages_.end() && are_same(at->second.call, call)) {
    std::set<JobId>& jobs = at->second.jobs;
    jobs.insert(job);
    if (jobs.size() > kMaxJobs) {
      discard(call, jobs.extract(jobs.begin()).value());
    }
  } else {
    discard(call, job);
  }
}

void PageJobs::tick() {
  const Time now = clock_.now();
  for (auto at = pages_.begin(); at != pages_.end();) {
    Page& page = at->second;
    if (page.connections > 0 || now < page.left_at + kTimeout) {
      ++at;
      continue;
    }
    for (const JobId job : page.jobs) {
      discard(page.call, job);
    }
    at = pages_.erase(at);
  }
  if (now >= next_try_) {
    next_try_ = now + kTryInterval;
    for (const auto& [job, call] : std::map(left_)) {
      discard(call, job);
    }
  }
}

void PageJobs::discard(const Call& call, JobId job) {
  left_.try_emplace(job, Call{call.caller, find_operation("DeleteJob")->rpc, call.peer});
  if (!under_way_.insert(job).second) {
    return;
  }
  discard_(left_.at(job), job, [weak = std::weak_ptr<PageJobs*>(self_), job](bool gone) {
    if (const auto here = weak.lock()) {
      (*here)->under_way_.erase(job);
      if (gone) {
        (*here)->left_.erase(job);
      }
    }
  });
}

}  // namespace lightmill

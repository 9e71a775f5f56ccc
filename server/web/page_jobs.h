// Jobs that are deleted when the page that submitted them has no connection any more.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>

#include "common/base/clock.h"
#include "common/base/ids.h"
#include "server/access/rights.h"
#include "server/web/job_feed.h"

namespace lightmill {

/// Used on the web thread. A page chooses its own name, and sends it over each of its connections.
class PageJobs {
 public:
  /// Time for a page to reconnect.
  static constexpr Duration kTimeout = std::chrono::seconds(5);
  /// Jobs of one page. The oldest one is deleted for a new one.
  static constexpr std::size_t kMaxJobs = 16;
  /// Deletes a job of the caller in any state. Calls `done` on the web thread: whether the job is gone.
  using Discard = std::function<void(const Call& call, JobId job, std::function<void(bool gone)> done)>;

  PageJobs(OnWebThread on_web_thread, const Clock& clock, Discard discard);

  /// A connection belongs to this page. PERMISSION_DENIED if the page is another caller's.
  Status connected(const std::string& page, const Call& call);
  /// A connection of this page has ended.
  void disconnected(const std::string& page);
  /// Whether a job may be submitted for this page. FAILED_PRECONDITION.
  Status check(const std::string& page, const Call& call) const;
  /// A function that adds a submitted job to the page, from any thread. The job is deleted if the page is gone by then.
  std::function<void(JobId)> submission_callback(const std::string& page, const Call& call);
  /// Deletes the jobs that are due.
  void tick();

 private:
  struct Page {
    Call call;
    int connections = 0;
    Time left_at{};  ///< if it has none
    std::set<JobId> jobs;
  };
  void add(const std::string& page, const Call& call, JobId job);
  void discard(const Call& call, JobId job);

  const OnWebThread on_web_thread_;
  const Clock& clock_;
  const Discard discard_;
  /// Lets functions on other threads notice that this object is gone.
  const std::shared_ptr<PageJobs*> self_ = std::make_shared<PageJobs*>(this);
  std::map<std::string, Page> pages_;
  std::map<JobId, Call> left_;  ///< to be deleted
  std::set<JobId> under_way_;   ///< those whose deletion is in progress
  Time next_try_{};
};

}  // namespace lightmill

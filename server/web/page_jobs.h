// Jobs that live as long as the page that submitted them: they are deleted once the page has no connection any more.
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

/// Belongs to the web's thread. A page is known by a name that it has made up, and says over each of its connections.
class PageJobs {
 public:
  /// A page without a connection may come back for so long.
  static constexpr Duration kPatience = std::chrono::seconds(5);
  /// Of one page; the oldest is deleted for another.
  static constexpr std::size_t kMostJobs = 16;
  /// Deletes a job of the caller's, whatever state it is in. `done` is called on the web's thread: whether it is gone.
  using Discard = std::function<void(const Call& call, JobId job, std::function<void(bool gone)> done)>;

  PageJobs(OnWebThread on_web_thread, const Clock& clock, Discard discard);

  /// A connection says that it is this page's. PERMISSION_DENIED if the page is another caller's.
  Status connected(const std::string& page, const Call& call);
  /// That connection has ended.
  void disconnected(const std::string& page);
  /// Whether a job may be submitted for this page. FAILED_PRECONDITION.
  Status check(const std::string& page, const Call& call) const;
  /// A job was submitted for it, from whichever thread. It is deleted if the page is gone by now.
  std::function<void(JobId)> told_by_others(const std::string& page, const Call& call);
  /// Deletes what is to be deleted by now.
  void tick();

 private:
  struct Page {
    Call call;
    int connections = 0;
    Time left_at{};  ///< once it has none
    std::set<JobId> jobs;
  };
  void add(const std::string& page, const Call& call, JobId job);
  void discard(const Call& call, JobId job);

  const OnWebThread on_web_thread_;
  const Clock& clock_;
  const Discard discard_;
  /// What is under way elsewhere finds out by this that it is gone.
  const std::shared_ptr<PageJobs*> self_ = std::make_shared<PageJobs*>(this);
  std::map<std::string, Page> pages_;
  std::map<JobId, Call> left_;  ///< to be deleted
  std::set<JobId> under_way_;   ///< of them
  Time next_try_{};
};

}  // namespace lightmill

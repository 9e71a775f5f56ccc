// Live updates for open pages: tells each viewer what changed since its last message, as fast as it reads.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "server/access/rights.h"
#include "server/web/job_feed.h"
#include "server/web/list_changes.h"
#include "server/web/page_jobs.h"

namespace lightmill {

/// One WebSocket message: the concatenation of these bytes.
using MessageParts = std::vector<SharedBytes>;

/// The socket of one viewer.
class ViewerLink {
 public:
  virtual ~ViewerLink() = default;
  /// Whether the last message is still being written.
  virtual bool busy() const = 0;
  virtual void send(MessageParts parts) = 0;
  /// Closes the socket, because the viewer's credentials have expired.
  virtual void close(const Status& why) = 0;
};

/// Used on the web thread. There are no queues: when a viewer can take a message, the change logs give what it has
/// missed. Hidden pages get nothing.
class LiveHub {
 public:
  /// Whether a viewer's credentials are still valid.
  using Holds = std::function<Status()>;
  /// Called for jobs that a viewer may not see.
  using OnRefused = std::function<void(const Call&, JobId, const Status&)>;
  LiveHub(
      FarmLoop& loop, FarmGreeting greeting, OnWebThread on_web_thread, const Clock& clock,
      OnRefused on_refused = [](const Call&, JobId, const Status&) {},
      std::uint64_t picture_bytes = std::uint64_t{1} << 30,
      PageJobs::Discard discard = [](const Call&, JobId, const std::function<void(bool)>&) {});

  PageJobs& page_jobs() { return page_jobs_; }

  /// `link` is used until remove().
  void add(
      ViewerLink& link, Call call, Holds holds = [] { return ok_status(); });
  void remove(ViewerLink& link);
  /// Sets what the viewer wants from now on. INVALID_ARGUMENT.
  Status ask(ViewerLink& link, std::string_view message);
  /// The link can send again.
  void written(ViewerLink& link);
  /// Call it every kTick.
  void tick();
  static constexpr Duration kTick = std::chrono::milliseconds(50);

 private:
  /// One layer of the watched job.
  struct Watched {
    std::string layer;
    std::shared_ptr<JobFeed> feed;
    ChangeCursor tiles;
    std::string failure_sent;
  };
  struct Viewer {
    Call call;
    Holds holds;
    bool closed = false;
    ViewRequest request;
    bool asked = false, greeted = false;
    std::uint64_t sent = 0;  ///< number of messages
    ChangeCursor jobs, workers;
    std::uint64_t job_version = 0;
    std::string failure_sent;
    Time next_picture{}, last_sent{};
    std::vector<Watched> layers;  ///< beauty first; empty if no job is watched
    std::size_t next_layer = 0;   ///< which layer is sent first next time
  };
  struct Message {
    ViewUpdateWriter head;
    MessageParts tiles;
    bool any = false;
  };
  void poll_farm();
  void take(const ListChanges& changes);
  std::shared_ptr<JobFeed> feed_of(JobId job, const std::string& layer);
  void watch(Viewer& viewer, const ViewRequest& request);
  void drop_unwatched_feeds();
  void retry_failed_feeds();
  void serve_all();
  Status name_page(Viewer& viewer, const std::string& page);
  bool holds(ViewerLink& link, Viewer& viewer);
  void check_viewers();
  void serve(ViewerLink& link, Viewer& viewer);
  void add_jobs(Viewer& viewer, Message& message) const;
  void add_workers(Viewer& viewer, Message& message) const;
  /// Adds the job's state, or why it is not shown. Returns whether the viewer may see it.
  bool add_job(Viewer& viewer, Message& message) const;
  void add_layer_failures(Viewer& viewer, Message& message) const;
  void add_tiles(Viewer& viewer, Time now, Message& message) const;

  FarmLoop& loop_;
  const FarmGreeting greeting_;
  const OnWebThread on_web_thread_;
  const Clock& clock_;
  const OnRefused on_refused_;
  PageJobs page_jobs_;
  /// Lets functions on other threads notice that the hub is gone.
  const std::shared_ptr<LiveHub*> self_ = std::make_shared<LiveHub*>(this);
  LiveDenoiser denoiser_;
  std::map<ViewerLink*, Viewer> viewers_;
  std::map<std::pair<JobId, std::string>, std::shared_ptr<JobFeed>> feeds_;  ///< by job and layer
  const std::shared_ptr<TileBudget> tile_budget_;
  ChangeLog<JobId> jobs_;
  ChangeLog<std::string> workers_;
  const std::shared_ptr<ListTracker> list_tracker_ = std::make_shared<ListTracker>();
  bool polling_ = false, polled_ = false;
  Time next_poll_{}, next_retry_{}, next_check_{};
};

}  // namespace lightmill

#include "server/web/live_hub.h"

#include <algorithm>
#include <set>
#include <utility>

#include "server/operations/operation.h"

namespace lightmill {
namespace {

constexpr Duration kPollInterval = std::chrono::milliseconds(500);
constexpr Duration kRetryInterval = std::chrono::seconds(2);
constexpr Duration kCheckInterval = std::chrono::seconds(1);
/// An idle connection gets a message at this interval, so the page knows that it works.
constexpr Duration kHeartbeat = std::chrono::seconds(5);
constexpr Duration kPictureInterval = std::chrono::milliseconds(200);
constexpr Duration kFirstRoundInterval = std::chrono::milliseconds(40);
/// Limit of messages that the page has not confirmed.
constexpr std::uint64_t kWindow = 2;
/// Tiles of 32 KiB each.
constexpr std::size_t kTilesPerMessage = 96;
constexpr std::size_t kEntriesPerMessage = 500;

}  // namespace

LiveHub::LiveHub(FarmLoop& loop, FarmGreeting greeting, OnWebThread on_web_thread, const Clock& clock,
                 OnRefused on_refused, std::uint64_t picture_bytes, PageJobs::Discard discard)
    : loop_(loop),
      greeting_(std::move(greeting)),
      on_web_thread_(std::move(on_web_thread)),
      clock_(clock),
      on_refused_(std::move(on_refused)),
      page_jobs_(on_web_thread_, clock, std::move(discard)),
      denoiser_(loop, on_web_thread_),
      tile_budget_(std::make_shared<TileBudget>(TileBudget{picture_bytes / TileBudget::kTileBytes})) {}

void LiveHub::add(ViewerLink& link, Call call, Holds holds) {
  Viewer& viewer = viewers_[&link];
  viewer.call = std::move(call);
  viewer.holds = std::move(holds);
}

void LiveHub::remove(ViewerLink& link) {
  (void)name_page(viewers_.at(&link), "");
  viewers_.erase(&link);
  drop_unwatched_feeds();
}

Status LiveHub::ask(ViewerLink& link, std::string_view message) {
  LM_ASSIGN_OR_RETURN(const ViewRequest request, parse_view_request(message));
  Viewer& viewer = viewers_.at(&link);
  if (request.seen > viewer.sent) {
    return invalid_argument("seen: {} messages, but {} were sent", request.seen, viewer.sent);
  }
  LM_RETURN_IF_ERROR(name_page(viewer, request.page));
  if (request.job != viewer.request.job) {
    viewer.job_version = 0;
    viewer.failure_sent.clear();
    viewer.layers.clear();
  }
  if (request.job != viewer.request.job || request.layers != viewer.request.layers) {
    watch(viewer, request);
  }
  viewer.request = request;
  viewer.asked = true;
  poll_farm();
  serve(link, viewer);
  return ok_status();
}

Status LiveHub::name_page(Viewer& viewer, const std::string& page) {
  if (page == viewer.request.page) {
    return ok_status();
  }
  if (!page.empty()) {
    LM_RETURN_IF_ERROR(page_jobs_.connected(page, viewer.call));
  }
  if (const std::string before = std::exchange(viewer.request.page, page); !before.empty()) {
    page_jobs_.disconnected(before);
  }
  return ok_status();
}

/// Layers that are watched already continue at their position.
void LiveHub::watch(Viewer& viewer, const ViewRequest& request) {
  std::vector<Watched> before = std::exchange(viewer.layers, {});
  const auto add = [&](const std::string& layer) {
    const auto known = std::ranges::find(before, layer, &Watched::layer);
    viewer.layers.push_back(known != before.end() ? std::move(*known)
                                                  : Watched{layer, feed_of(request.job, layer), {}, {}});
  };
  if (request.job.value != 0) {
    add("");
    std::ranges::for_each(request.layers, add);
  }
  viewer.next_picture = Time{};
  before.clear();
  drop_unwatched_feeds();
}

void LiveHub::written(ViewerLink& link) {
  serve(link, viewers_.at(&link));
}

void LiveHub::tick() {
  poll_farm();
  retry_failed_feeds();
  check_viewers();
  page_jobs_.tick();
  serve_all();
}

/// Also checks viewers that are not served, such as hidden pages.
void LiveHub::check_viewers() {
  if (clock_.now() < next_check_) {
    return;
  }
  next_check_ = clock_.now() + kCheckInterval;
  for (auto& [link, viewer] : viewers_) {
    (void)holds(*link, viewer);
  }
}

/// Closes the viewer's socket if its credentials have expired.
bool LiveHub::holds(ViewerLink& link, Viewer& viewer) {
  const Status status = viewer.holds();
  if (!status.ok() && !viewer.closed) {
    viewer.closed = true;
    link.close(status);
  }
  return status.ok();
}

/// Asks the farm thread for changes, if a viewer wants them and the last answer is old enough.
void LiveHub::poll_farm() {
  const Time now = clock_.now();
  const bool wanted =
      std::ranges::any_of(viewers_, [](const auto& each) { return each.second.asked && !each.second.request.hidden; });
  if (polling_ || !wanted || now < next_poll_) {
    return;
  }
  std::vector<JobId> ended;
  for (const auto& [key, feed] : feeds_) {
    if (feed->ended() && (ended.empty() || ended.back() != key.first)) {
      ended.push_back(key.first);
    }
  }
  polling_ = loop_.post([tracker = list_tracker_, ended = std::move(ended), hub = std::weak_ptr<LiveHub*>(self_),
                         on_web_thread = on_web_thread_](FarmLoop::TaskContext& context) {
    auto changes = std::make_shared<const ListChanges>(tracker->poll(context.farm, context.now, ended));
    on_web_thread([changes, hub] {
      if (const auto here = hub.lock(); here != nullptr) {
        (*here)->take(*changes);
      }
    });
  });
  next_poll_ = now + kPollInterval;
}

void LiveHub::take(const ListChanges& changes) {
  polling_ = false;
  polled_ = true;
  for (auto job = changes.jobs.rbegin(); job != changes.jobs.rend(); ++job) {
    jobs_.put(job->id, job_bytes(*job, false), job->spec.owner);
  }
  for (const JobId job : changes.removed) {
    jobs_.remove(job);
  }
  std::set<std::string> names;
  for (const WorkerStatus& worker : changes.workers) {
    workers_.put(worker.name, worker_bytes(worker));
    names.insert(worker.name);
  }
  for (const std::string& name : workers_.keys()) {
    if (!names.contains(name)) {
      workers_.remove(name);
    }
  }
  for (const auto& [key, feed] : feeds_) {
    if (feed->ended() && std::ranges::count(changes.revived, key.first) > 0) {
      feed->watch();
    }
  }
  serve_all();
}

std::shared_ptr<JobFeed> LiveHub::feed_of(JobId job, const std::string& layer) {
  std::shared_ptr<JobFeed>& feed = feeds_[{job, layer}];
  if (feed == nullptr) {
    feed = std::make_shared<JobFeed>(job, layer, loop_, on_web_thread_, tile_budget_, denoiser_, [this, job] {
      for (auto& [link, viewer] : viewers_) {
        if (viewer.request.job == job) {
          serve(*link, viewer);
        }
      }
    });
    feed->watch();
  }
  return feed;
}

void LiveHub::drop_unwatched_feeds() {
  std::set<const JobFeed*> watched;
  for (const auto& [link, viewer] : viewers_) {
    for (const Watched& layer : viewer.layers) {
      watched.insert(layer.feed.get());
    }
  }
  std::erase_if(feeds_, [&](const auto& each) {
    if (watched.contains(each.second.get())) {
      return false;
    }
    each.second->close();  // a function on this thread may still hold it
    return true;
  });
}

/// A missing job is retried, too: it may be submitted later.
void LiveHub::retry_failed_feeds() {
  if (clock_.now() < next_retry_) {
    return;
  }
  next_retry_ = clock_.now() + kRetryInterval;
  for (const auto& [key, feed] : feeds_) {
    if (feed->may_retry()) {
      feed->watch();
    }
  }
}

void LiveHub::serve_all() {
  for (auto& [link, viewer] : viewers_) {
    serve(*link, viewer);
  }
}

void LiveHub::serve(ViewerLink& link, Viewer& viewer) {
  if (!viewer.asked || viewer.request.hidden || link.busy() || viewer.sent - viewer.request.seen >= kWindow) {
    return;
  }
  const Time now = clock_.now();
  Message message;
  if (!viewer.greeted) {
    FarmGreeting greeting = greeting_;
    greeting.caller = viewer.call.caller;
    message.head.greet(greeting);
    message.any = viewer.greeted = true;
  }
  add_jobs(viewer, message);
  add_workers(viewer, message);
  if (!viewer.layers.empty()) {
    if (!add_job(viewer, message)) {
      viewer.layers.clear();
      drop_unwatched_feeds();
    } else if (viewer.failure_sent.empty()) {
      add_layer_failures(viewer, message);
      add_tiles(viewer, now, message);
    }
  }
  if ((!message.any && now - viewer.last_sent < kHeartbeat) || !holds(link, viewer)) {
    return;
  }
  MessageParts parts{std::make_shared<const std::string>(message.head.take())};
  parts.insert(parts.end(), message.tiles.begin(), message.tiles.end());
  ++viewer.sent;
  viewer.last_sent = now;
  link.send(std::move(parts));
}

void LiveHub::add_jobs(Viewer& viewer, Message& message) const {
  if (!polled_ || !viewer.request.jobs || !jobs_.has_changes_for(viewer.jobs) ||
      !check_call(viewer.call.caller, kListJobs).ok()) {
    return;
  }
  const auto changes = jobs_.since(viewer.jobs, kEntriesPerMessage);
  std::vector<SharedBytes> jobs;
  std::vector<JobId> removed;
  for (const auto& [job, entry] : changes.entries) {
    if (entry->bytes == nullptr) {
      removed.push_back(job);
    } else if (may_see_job(viewer.call.caller, entry->owner)) {
      jobs.push_back(entry->bytes);
    }
  }
  message.head.jobs(jobs, removed, changes.whole);
  message.any = true;
}

void LiveHub::add_workers(Viewer& viewer, Message& message) const {
  if (!polled_ || !viewer.request.workers || !workers_.has_changes_for(viewer.workers) ||
      !check_call(viewer.call.caller, kListWorkers).ok()) {
    return;
  }
  const auto changes = workers_.since(viewer.workers, kEntriesPerMessage);
  std::vector<SharedBytes> workers;
  std::vector<std::string> removed;
  for (const auto& [name, entry] : changes.entries) {
    if (entry->bytes == nullptr) {
      removed.push_back(name);
    } else {
      workers.push_back(entry->bytes);
    }
  }
  message.head.workers(workers, removed, changes.whole);
  message.any = true;
}

bool LiveHub::add_job(Viewer& viewer, Message& message) const {
  const JobFeed& feed = *viewer.layers.front().feed;
  Status failure = feed.failure();
  if (failure.ok() && feed.known()) {
    failure = check_job(viewer.call.caller, kWatchJob, feed.owner());
  }
  if (const std::string text = message_of(failure); text != viewer.failure_sent) {
    viewer.failure_sent = text;
    viewer.job_version = 0;  // the next state of the job ends the failure
    if (!failure.ok()) {
      message.head.job_failure(failure);
      message.any = true;
    }
    if (failure.code() == StatusCode::kPermissionDenied) {
      on_refused_(viewer.call, viewer.request.job, failure);
    }
  }
  if (failure.ok() && feed.known() && viewer.job_version != feed.state_version()) {
    viewer.job_version = feed.state_version();
    message.head.job(feed.state());
    message.any = true;
  }
  return failure.code() != StatusCode::kPermissionDenied;
}

/// A layer that cannot be shown does not affect the job and its other layers.
void LiveHub::add_layer_failures(Viewer& viewer, Message& message) const {
  for (Watched& layer : viewer.layers) {
    Status failure = layer.feed->failure();
    failure.Update(layer.feed->picture_failure());
    if (const std::string text = message_of(failure); text != layer.failure_sent) {
      layer.failure_sent = text;
      message.head.layer_failure(viewer.request.job, layer.layer, failure);
      message.any = true;
    }
  }
}

void LiveHub::add_tiles(Viewer& viewer, Time now, Message& message) const {
  if (now < viewer.next_picture) {
    return;
  }
  bool more = false;
  // Layers take turns, so a picture that changes faster than it can be sent does not block others.
  const std::size_t begin = viewer.next_layer;
  for (std::size_t i = 0; i < viewer.layers.size(); ++i) {
    const std::size_t at = (begin + i) % viewer.layers.size();
    Watched& watched = viewer.layers[at];
    const auto& tiles = watched.feed->tiles();
    if (tiles.size() == 0 || !tiles.has_changes_for(watched.tiles)) {
      continue;
    }
    if (message.tiles.size() >= kTilesPerMessage) {
      more = true;
      break;
    }
    const auto changes = tiles.since(watched.tiles, kTilesPerMessage - message.tiles.size());
    for (const auto& [corner, entry] : changes.entries) {
      message.tiles.push_back(entry->bytes);
    }
    more = more || changes.more;
    viewer.next_layer = at + 1;
  }
  if (message.tiles.empty()) {
    return;
  }
  message.any = true;
  const bool whole = viewer.layers.front().feed->every_tile_has_samples();
  viewer.next_picture = more ? now : now + (whole ? kPictureInterval : kFirstRoundInterval);
}

}  // namespace lightmill

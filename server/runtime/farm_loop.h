// Farm loop: runs the farm thread, the only one that uses the coordinator. It runs posted tasks, ticks, updates the
// watchers, and gives effects to the commit queue.
#pragma once

#include <functional>
#include <map>
#include <set>
#include <thread>
#include <vector>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "server/access/action_log.h"
#include "server/domain/coordinator.h"
#include "server/domain/farm_events.h"
#include "server/domain/farm_history.h"
#include "server/runtime/commit_queue.h"
#include "server/runtime/demand_hub.h"
#include "server/runtime/traffic.h"
#include "server/runtime/watch_hub.h"

namespace lightmill {

/// History and events since the coordinator started.
struct Activity {
  FarmHistory history;
  FarmEvents events;
};

class FarmLoop {
 public:
  /// Called on the farm thread.
  using InspectionReply = std::function<void(const Result<std::shared_ptr<const Inspection>>&)>;
  struct TaskContext;
  using Task = std::function<void(TaskContext&)>;
  /// Called with OK if the film is in memory during this call, else with the error.
  using FilmTask = std::function<void(TaskContext&, const Status&)>;
  struct FilmTasks {
    std::multimap<JobId, FilmTask> waiting;
    bool closed = false;  ///< no task may wait any longer
  };

  /// Context of a task; valid during the task.
  struct TaskContext {
    Coordinator& farm;
    WatchHub& watchers;
    DemandHub& demand;
    ActionLog& actions;
    std::map<InspectionId, InspectionReply>& inspections;
    FilmTasks& films;
    Activity& activity;
    Time now;
    std::int64_t unix_ms;
    Effects effects;                   ///< filled by the coordinator
    std::vector<CommitReply> replies;  ///< called when `effects` are durable
    std::vector<CommitReply> callers;  ///< the same, or sooner with an error (CommitQueue::Batch)
    /// Why nothing can be stored now; empty while storing works.
    const std::string& no_store;
    /// Why the disk has no room for new jobs; empty while it has.
    const std::string& no_space;

    /// Adds an action to the action log, with the time of this task.
    void keep(Action action);
    /// Like Coordinator::inspect. `reply` is called once, unless the inspection is forgotten.
    Result<InspectionId> inspect(const std::string& caller, const InspectionRequest& request, InspectionReply reply);
    void forget_inspection(InspectionId id);
    /// Runs `task` when the job's film is in memory: at once or later. Errors: NOT_FOUND, RESOURCE_EXHAUSTED if reading
    /// takes too long, UNAVAILABLE when the coordinator stops, and errors of the store.
    void with_film(JobId job, FilmTask task);
  };

  /// Callbacks of the server that workers connect to.
  struct Handlers {
    std::function<void(Outgoing)> send = [](const Outgoing&) {};  ///< from the farm thread and the commit thread
    std::function<void(SessionId)> disconnect = [](SessionId) {};
    /// Called from the farm thread at the start and at each change: whether the state can be stored.
    std::function<void(bool)> on_storing = [](bool) {};
  };
  /// `on_fatal`: the store is unusable. From another thread.
  FarmLoop(Coordinator& farm, ActionLog& actions, Store& store, const Clock& clock,
           std::function<void(const Status&)> on_fatal);
  ~FarmLoop();

  /// Call once, before the first worker connects. They are called as long as the loop runs.
  void set_handlers(Handlers handlers);
  /// Bytes of requests whose tasks wait.
  static constexpr std::uint64_t kMaxTaskBytes = std::uint64_t{128} << 20;
  /// Queues a task that keeps `bytes` bytes of a request. If too many tasks or bytes wait, or the loop has stopped, it
  /// returns false and does not run the task. A task that finds the queue empty may have any size. Thread-safe.
  [[nodiscard]] bool post(Task task, std::uint64_t bytes = 0);
  /// Like post, for tasks that must not get lost: messages of workers, ends of their streams, and replies of commits.
  /// Their number is bounded by the number of worker streams (--max-workers) and the message window of each.
  void post_always(Task task);
  /// Stops leasing while `why` is not empty, because the disk has no space for results. Thread-safe.
  void set_space(const std::string& why);
  /// Wakes the loop to update the watchers. Thread-safe.
  void wake();

  Traffic& traffic() { return traffic_; }
  /// Times of commits in seconds.
  Histogram commit_seconds() const { return commits_.seconds(); }

  /// Stops waiting: failing commits are not retried, and tasks that wait for films fail.
  void stop_waiting();
  /// Runs what is queued, commits it, and ends the threads. Post no task afterwards.
  Status stop();

 private:
  void run();
  void log_notes(TaskContext& context);
  void notify_inspections(TaskContext& context);
  void notify_films(TaskContext& context);
  void refuse_films(TaskContext& context);
  std::vector<FilmRead> film_reads(const TaskContext& context);
  void note_ends(TaskContext& context);
  void note_sent(TaskContext& context);
  /// Like WatchHub::publish, unless it is too soon.
  std::optional<Time> notify_watchers(Time now);
  void tick(TaskContext& context);
  void log_quarantines(TaskContext& context);
  void set_stall(const Status& status);
  void hold(TaskContext& context);

  Coordinator& farm_;
  ActionLog& actions_;
  const Clock& clock_;
  Handlers handlers_;  ///< set on the farm thread; the commit thread reads it after a worker has connected
  Traffic traffic_;
  CommitQueue commits_;
  WatchHub watchers_;
  DemandHub demand_;
  Time watchers_after_{};  ///< watchers get nothing before this; only for the farm thread
  Mutex mutex_;
  CondVar changed_;
  std::vector<Task> tasks_ LM_GUARDED_BY(mutex_);
  std::uint64_t task_bytes_ LM_GUARDED_BY(mutex_) = 0;
  bool poked_ LM_GUARDED_BY(mutex_) = false;
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::map<InspectionId, InspectionReply> inspections_;  ///< only for the farm thread
  FilmTasks films_;                                      ///< only for the farm thread
  Activity activity_;                                    ///< only for the farm thread
  std::string no_store_;                                 ///< why nothing can be stored; only for the farm thread
  std::string no_space_;                                 ///< why leasing is stopped; only for the farm thread
  std::thread thread_;
};

/// Error of a farm that has no room for another task (FarmLoop::post). RESOURCE_EXHAUSTED.
inline Status busy() {
  return resource_exhausted("the farm has too much to do at once: try again");
}

}  // namespace lightmill

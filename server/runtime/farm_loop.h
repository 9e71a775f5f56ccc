// The farm thread: the only one that touches the coordinator. It runs posted tasks one after the other, ticks, feeds
// the watchers, and hands what is to be stored to the commit queue.
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

/// What was, since the coordinator began.
struct FarmPast {
  FarmHistory history;
  FarmEvents events;
};

class FarmLoop {
 public:
  /// Called on the farm thread.
  using InspectionReply = std::function<void(const Result<std::shared_ptr<const Inspection>>&)>;
  struct Turn;
  using Task = std::function<void(Turn&)>;
  /// Told whether the film is in memory, for this call, or why not.
  using FilmTask = std::function<void(Turn&, const Status&)>;
  struct FilmTasks {
    std::multimap<JobId, FilmTask> waiting;
    bool closed = false;  ///< nobody is to wait any more
  };

  /// What a task works with; valid during the task.
  struct Turn {
    Coordinator& farm;
    WatchHub& watchers;
    DemandHub& demand;
    ActionLog& actions;
    std::map<InspectionId, InspectionReply>& inspections;
    FilmTasks& films;
    FarmPast& past;
    Time now;
    std::int64_t unix_ms;
    Effects effects;                   ///< filled by the coordinator
    std::vector<CommitReply> replies;  ///< called once they are durable
    std::vector<CommitReply> callers;  ///< so, too, unless that takes long (CommitQueue::Batch)
    /// Why nothing can be stored now; empty while it can.
    const std::string& no_store;

    /// Writes an action into the farm's log, at this moment.
    void keep(Action action);
    /// As Coordinator::inspect; `reply` is called once, unless the inspection is forgotten.
    Result<InspectionId> inspect(const std::string& caller, const InspectionRequest& request, InspectionReply reply);
    void forget_inspection(InspectionId id);
    /// Runs `task` once the job's film is in memory: at once, or in a later turn. NOT_FOUND, RESOURCE_EXHAUSTED if that
    /// takes too long, UNAVAILABLE when the coordinator stops, and errors of the store.
    void with_film(JobId job, FilmTask task);
  };

  /// What the server is told by which workers come.
  struct Handlers {
    std::function<void(Outgoing)> send = [](const Outgoing&) {};  ///< from the farm thread and the writer thread
    std::function<void(SessionId)> hang_up = [](SessionId) {};
    /// Whether the state can be stored, now and whenever that changes; from the farm thread.
    std::function<void(bool)> on_storing = [](bool) {};
  };
  /// `on_fatal`: the store cannot be used any more; from another thread.
  FarmLoop(Coordinator& farm, ActionLog& actions, Store& store, const Clock& clock,
           std::function<void(const Status&)> on_fatal);
  ~FarmLoop();

  /// Once, before the first worker comes. They are called as long as the loop runs.
  void set_handlers(Handlers handlers);
  /// Queues a task. False, and it will not run, when kMaxTasks wait or the loop has stopped. Thread-safe.
  [[nodiscard]] bool post(Task task);
  /// As post, for what must not get lost: messages of workers, the ends of their streams, and what commits report.
  /// Their senders bound them: at most so many worker streams (--max-workers decides), each with a window of messages.
  void post_always(Task task);
  /// No work is handed out while `why` is not empty: there is no space for what it gives. Thread-safe.
  void set_space(const std::string& why);
  /// Lets the watchers be looked at again. Thread-safe.
  void poke();

  Traffic& traffic() { return traffic_; }
  /// Seconds that commits took.
  Histogram commit_seconds() const { return commits_.seconds(); }

  /// Nobody waits any longer for what takes long: commits that fail are given up, and films are not waited for.
  void stop_waiting();
  /// Runs what is queued, commits it and ends the threads. No task may be posted afterwards.
  Status stop();

 private:
  void run();
  void tell_notes(Turn& turn);
  void tell_inspected(Turn& turn);
  void tell_films(Turn& turn);
  void refuse_films(Turn& turn);
  std::vector<FilmRead> film_reads(const Turn& turn);
  void note_ends(Turn& turn);
  void note_sent(Turn& turn);
  /// As WatchHub::publish, unless it is too soon for that.
  std::optional<Time> tell_watchers(Time now);
  void tick(Turn& turn);
  void set_stall(const Status& status);
  void hold(Turn& turn);

  Coordinator& farm_;
  ActionLog& actions_;
  const Clock& clock_;
  Handlers handlers_;  ///< of the farm thread; the writer thread reads it once a worker has come
  Traffic traffic_;
  CommitQueue commits_;
  WatchHub watchers_;
  DemandHub demand_;
  Time watchers_after_{};  ///< nothing is told before; the farm thread's own
  Mutex mutex_;
  CondVar changed_;
  std::vector<Task> tasks_ LM_GUARDED_BY(mutex_);
  bool poked_ LM_GUARDED_BY(mutex_) = false;
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::map<InspectionId, InspectionReply> inspections_;  ///< the farm thread's own
  FilmTasks films_;                                      ///< the farm thread's own
  FarmPast past_;                                        ///< the farm thread's own
  std::string no_store_;                                 ///< why nothing can be stored; the farm thread's own
  std::string no_space_;                                 ///< why no work is handed out; the farm thread's own
  std::thread thread_;
};

}  // namespace lightmill

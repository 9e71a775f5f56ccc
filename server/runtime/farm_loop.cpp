#include "server/runtime/farm_loop.h"

#include <ctime>

#include "common/base/log.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxTasks = 20'000;
/// Watchers get at most a tenth of the farm thread's time, so that workers go first. The pause is this multiple of it.
constexpr int kPausePerWatching = 9;

/// CPU time of this thread.
Duration cpu_time() {
  timespec time{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return std::chrono::seconds(time.tv_sec) + std::chrono::nanoseconds(time.tv_nsec);
}

}  // namespace

FarmLoop::FarmLoop(Coordinator& farm, ActionLog& actions, Store& store, const Clock& clock,
                   std::function<void(const Status&)> on_fatal)
    : farm_(farm),
      actions_(actions),
      clock_(clock),
      commits_(store, {[this](Outgoing message) { handlers_.send(std::move(message)); }, std::move(on_fatal),
                       [this](const Status& status) { set_stall(status); }}),
      thread_([this] { run(); }) {}

FarmLoop::~FarmLoop() {
  if (thread_.joinable()) {
    (void)stop();
  }
}

void FarmLoop::set_handlers(Handlers handlers) {
  post_always([this, handlers = std::move(handlers)](const TaskContext&) {
    handlers_ = handlers;
    handlers_.on_storing(no_store_.empty());
  });
}

bool FarmLoop::post(Task task, std::uint64_t bytes) {
  const MutexLock lock(mutex_);
  const bool fits = task_bytes_ == 0 || task_bytes_ + bytes <= kMaxTaskBytes;
  if (stopping_ || tasks_.size() >= kMaxTasks || !fits) {
    return false;
  }
  task_bytes_ += bytes;
  tasks_.push_back(std::move(task));
  changed_.notify_one();
  return true;
}

void FarmLoop::post_always(Task task) {
  const MutexLock lock(mutex_);
  tasks_.push_back(std::move(task));
  changed_.notify_one();
}

void FarmLoop::wake() {
  const MutexLock lock(mutex_);
  poked_ = true;
  changed_.notify_one();
}

Status FarmLoop::stop() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_one();
  }
  thread_.join();
  return commits_.stop();
}

void FarmLoop::run() {
  std::optional<Time> watchers_due;
  for (;;) {
    std::vector<Task> tasks;
    bool stopping = false;
    {
      const MutexLock lock(mutex_);
      while (tasks_.empty() && !poked_ && !stopping_) {
        std::optional<Time> due = farm_.next_deadline();
        if (watchers_due && (!due || *watchers_due < *due)) {
          due = watchers_due;
        }
        const Duration left = std::min(due.value_or(activity_.history.next()), activity_.history.next()) - clock_.now();
        if (left <= Duration::zero() ||
            changed_.wait_until(mutex_, std::chrono::steady_clock::now() + left) == std::cv_status::timeout) {
          break;
        }
      }
      tasks.swap(tasks_);
      task_bytes_ = 0;
      poked_ = false;
      stopping = stopping_;
    }
    TaskContext context{.farm = farm_,
                        .watchers = watchers_,
                        .demand = demand_,
                        .actions = actions_,
                        .inspections = inspections_,
                        .films = films_,
                        .activity = activity_,
                        .now = clock_.now(),
                        .unix_ms = clock_.unix_milliseconds(),
                        .effects = {},
                        .replies = {},
                        .callers = {},
                        .no_store = no_store_,
                        .no_space = no_space_};
    for (const Task& task : tasks) {
      task(context);
      notify_films(context);
    }
    tick(context);
    notify_films(context);
    log_quarantines(context);
    for (Outgoing& message : context.effects.now) {
      handlers_.send(std::move(message));
    }
    for (const SessionId session : context.effects.closed) {
      handlers_.disconnect(session);
    }
    log_notes(context);
    for (const WorkerCount& worker : context.effects.departed) {
      activity_.history.depart(worker);
    }
    if (context.now >= activity_.history.next()) {
      activity_.history.add(farm_.load(), context.now, context.unix_ms);
    }
    notify_inspections(context);
    note_ends(context);
    watchers_due = notify_watchers(context.now);
    if (std::set<JobId> wanted = watchers_.take_wanted_films(); !wanted.empty()) {
      post_always([wanted = std::move(wanted)](TaskContext& later) {
        for (const JobId job : wanted) {
          (void)later.farm.use_film(job, later.now, later.effects);
        }
      });
    }
    if (const std::optional<Time> due = demand_.publish(farm_, context.now)) {
      watchers_due = std::min(watchers_due.value_or(*due), *due);
    }
    note_sent(context);
    commits_.push({std::move(context.effects.writes), std::move(context.effects.after_commit),
                   std::move(context.replies), std::move(context.callers), film_reads(context)});
    if (stopping && tasks.empty()) {
      refuse_films(context);
      for (const auto& [id, reply] : inspections_) {
        reply(unavailable("the coordinator stops"));
      }
      inspections_.clear();
      return;
    }
  }
}

std::optional<Time> FarmLoop::notify_watchers(Time now) {
  if (now < watchers_after_) {
    return watchers_after_;
  }
  const Duration before = cpu_time();
  const std::optional<Time> due = watchers_.publish(farm_, now);
  watchers_after_ = clock_.now() + kPausePerWatching * (cpu_time() - before);
  return due ? std::optional(std::max(*due, watchers_after_)) : std::nullopt;
}

void FarmLoop::tick(TaskContext& context) {
  const std::optional<Time> due = farm_.next_deadline();
  if (!due || *due > context.now) {
    return;
  }
  const std::size_t before = context.effects.writes.size();
  farm_.tick(context.now, context.unix_ms, context.effects);
  std::vector<DeleteJobRows> deleted;
  for (std::size_t i = before; i < context.effects.writes.size(); ++i) {
    if (const auto* job = std::get_if<DeleteJobRows>(&context.effects.writes[i])) {
      deleted.push_back(*job);
    }
  }
  for (const DeleteJobRows& job : deleted) {
    Action action;
    action.operation = kExpire;
    action.job = job.job.value;
    action.about = job.name;
    action.change = "deleted: --keep-days after its end";
    context.keep(std::move(action));
  }
}

/// Logs the workers that the farm itself puts into quarantine. Those of an operator are in the log as a call.
void FarmLoop::log_quarantines(TaskContext& context) {
  std::vector<Action> found;
  for (const StoreOp& write : context.effects.writes) {
    if (const auto* put = std::get_if<PutQuarantine>(&write); put && !put->record.reason.starts_with(kByHand)) {
      Action& action = found.emplace_back();
      action.operation = kQuarantine;
      action.about = put->record.of.worker;
      action.change = "put into quarantine: " + put->record.reason;
    }
  }
  for (Action& action : found) {
    context.keep(std::move(action));
  }
}

void FarmLoop::TaskContext::keep(Action action) {
  action.unix_ms = unix_ms;
  ActionLog::Change change = actions.add(std::move(action));
  if (change.added) {
    effects.writes.push_back(PutAction{std::move(*change.added)});
  }
  for (const std::uint64_t number : change.dropped) {
    effects.writes.push_back(DropAction{number});
  }
}

Result<InspectionId> FarmLoop::TaskContext::inspect(const std::string& caller, const InspectionRequest& request,
                                                    InspectionReply reply) {
  LM_ASSIGN_OR_RETURN(const InspectionId id, farm.inspect(caller, request, now, effects));
  inspections.emplace(id, std::move(reply));
  return id;
}

void FarmLoop::TaskContext::forget_inspection(InspectionId id) {
  farm.forget_inspection(id);
  inspections.erase(id);
}

void FarmLoop::TaskContext::with_film(JobId job, FilmTask task) {
  const Result<bool> here = farm.use_film(job, now, effects);
  if (!here.ok() || *here) {
    task(*this, here.status());
  } else if (films.closed) {
    task(*this, unavailable("the coordinator stops"));
  } else {
    films.waiting.emplace(job, std::move(task));
  }
}

/// Called before the next event, while the film is still in memory.
void FarmLoop::notify_films(TaskContext& context) {
  while (!context.effects.films.empty()) {
    const FilmOutcome outcome = context.effects.films.front();
    context.effects.films.erase(context.effects.films.begin());
    if (outcome.status.ok()) {
      watchers_.film_loaded(farm_, outcome.job, context.now);
    } else {
      watchers_.fail_film(outcome.job, outcome.status);
    }
    const auto [begin, end] = films_.waiting.equal_range(outcome.job);
    const std::multimap<JobId, FilmTask> tasks(begin, end);
    films_.waiting.erase(outcome.job);
    for (const auto& [job, task] : tasks) {
      if (outcome.status.ok()) {
        context.with_film(job, task);
      } else {
        task(context, outcome.status);
      }
    }
  }
}

void FarmLoop::refuse_films(TaskContext& context) {
  films_.closed = true;
  for (const auto& [job, task] : std::exchange(films_.waiting, {})) {
    task(context, unavailable("the coordinator stops"));
  }
}

void FarmLoop::stop_waiting() {
  commits_.stop_retrying();
  post_always([this](TaskContext& context) { refuse_films(context); });
}

std::vector<FilmRead> FarmLoop::film_reads(const TaskContext& context) {
  std::vector<FilmRead> reads;
  for (const JobId job : context.effects.film_reads) {
    reads.push_back({job, [this, job](Result<StoredFilm> film) {
                       const auto read = std::make_shared<Result<StoredFilm>>(std::move(film));
                       post_always([job, read](TaskContext& later) {
                         later.farm.film_read(job, std::move(*read), later.now, later.effects);
                       });
                     }});
  }
  return reads;
}

void FarmLoop::log_notes(TaskContext& context) {
  for (Note& note : context.effects.notes) {
    const Result<const JobSpec*> spec = farm_.spec(note.job);
    const LogTrace trace(spec.ok() ? trace_id((*spec)->request_id) : Hash128{}, note.lease.value);
    spdlog::log(note.level == Note::Level::warning ? spdlog::level::warn : spdlog::level::info, "{}", note.text);
    activity_.events.add(context.unix_ms, std::move(note), spec.ok() ? (*spec)->owner : "");
  }
}

void FarmLoop::notify_inspections(TaskContext& context) {
  for (const InspectionOutcome& outcome : context.effects.inspected) {
    if (const auto reply = inspections_.extract(outcome.id); !reply.empty()) {
      reply.mapped()(outcome.found);
    }
  }
}

void FarmLoop::set_space(const std::string& why) {
  post_always([this, why](TaskContext& context) {
    no_space_ = why;
    hold(context);
  });
}

void FarmLoop::set_stall(const Status& status) {
  post_always([this, status](TaskContext& context) {
    no_store_ = message_of(status);
    if (status.code() == StatusCode::kResourceExhausted) {
      no_store_ += ". Free space on its disk. Deleting jobs needs space there, too";
    }
    hold(context);
    handlers_.on_storing(status.ok());
  });
}

void FarmLoop::hold(TaskContext& context) {
  farm_.hold(no_store_.empty() ? no_space_ : "waits until its state can be stored again: " + no_store_, context.now,
             context.effects);
}

/// Starts the granted leases when their grants are sent.
void FarmLoop::note_sent(TaskContext& context) {
  std::vector<LeaseId> leases = leases_granted(context.effects.after_commit);
  if (leases.empty()) {
    return;
  }
  context.replies.push_back([this, leases = std::move(leases)](const Status& status) {
    if (status.ok()) {
      post_always([leases, now = clock_.now()](TaskContext& later) { later.farm.grants_sent(leases, now); });
    }
  });
}

/// When the ends of jobs are durable, shows them to clients, and to watchers without delay.
void FarmLoop::note_ends(TaskContext& context) {
  std::vector<JobId> ended = ends_in(context.effects.writes);
  if (ended.empty()) {
    return;
  }
  context.replies.push_back([this, ended = std::move(ended)](const Status& status) {
    if (status.ok()) {
      post_always([ended](TaskContext& later) {
        later.farm.ends_stored(ended);
        std::ranges::for_each(ended, [&](JobId job) { later.watchers.hurry(job); });
      });
    }
  });
}

}  // namespace lightmill

#include "server/domain/films.h"

#include "common/base/check.h"

namespace lightmill {
namespace {

/// A client that waits longer for a film gets an error, and tries again.
constexpr Duration kTimeout = std::chrono::seconds(30);
/// Pause before the next check of films that must leave but are shared.
constexpr Duration kCheckPause = std::chrono::milliseconds(200);

}  // namespace

bool Films::use(Job& job, Time now) {
  job.use_film(now);
  if (!job.has_film() && std::ranges::find(wanted_, job.id(), &Wanted::job) == wanted_.end()) {
    next_serve_ = wanted_.empty() ? now : next_serve_;
    wanted_.push_back({job.id(), now});
  }
  return job.has_film();
}

void Films::keep(Job& job, Time now) {
  job.use_film(now);
  next_check_ = std::min(next_check_.value_or(now + limits_.film_idle), now + limits_.film_idle);
}

std::uint64_t Films::bytes_of(JobId id) const {
  const Job* const job = jobs_.find(id);
  return job == nullptr ? 0 : job->outline().bytes();
}

bool Films::make_room(std::uint64_t bytes, Time now) {
  std::vector<Job*> ended;
  std::uint64_t needed = bytes + (reading_ ? bytes_of(wanted_.front().job) : 0), kept = 0;
  for (const auto& [id, job] : jobs_.all()) {
    if (job->active()) {
      needed += job->reserved_bytes();
    } else if (job->has_film() && job->outline().bytes() > 0) {
      kept += job->outline().bytes();
      ended.push_back(job.get());
    }
  }
  std::ranges::sort(ended, {}, &Job::film_used);
  next_check_.reset();
  for (Job* const job : ended) {
    const Time idle = job->film_used() + limits_.film_idle;
    if (needed + kept <= limits_.film_bytes && now < idle) {
      next_check_ = std::min(next_check_.value_or(idle), idle);
      break;  // all others were used more recently
    }
    if (job->film().shared()) {
      next_check_ = now + kCheckPause;
      continue;
    }
    kept -= job->outline().bytes();
    job->drop_film();
  }
  return kept == 0 || needed + kept <= limits_.film_bytes;
}

void Films::serve(const Event& event) {
  while (!reading_ && !wanted_.empty()) {
    const Job* const job = jobs_.find(wanted_.front().job);
    if (job == nullptr) {
      answered(wanted_.front().job, not_found("there is no job {}", wanted_.front().job.value), event);
      continue;
    }
    if (!make_room(job->outline().bytes(), event.now)) {
      next_serve_ = event.now + kCheckPause;
      return;
    }
    reading_ = true;
    event.effects.film_reads.push_back(job->id());
  }
}

void Films::answered(JobId job, const Status& status, const Event& event) {
  LM_CHECK(!wanted_.empty() && wanted_.front().job == job);
  wanted_.pop_front();
  reading_ = false;
  next_serve_ = event.now;
  event.effects.films.push_back({job, status});
}

/// Also for the film that is being read. Films of jobs that wait to reopen stay wanted.
void Films::give_up(const Event& event) {
  for (std::size_t i = 0; i < wanted_.size();) {
    Wanted& wanted = wanted_[i];
    if (event.now < wanted.since + kTimeout) {
      ++i;
      continue;
    }
    event.effects.films.push_back(
        {wanted.job,
         resource_exhausted("the film of job {} is not read from the store yet: films that are being sent take all "
                            "of --films-gib, or the store is slow. Try again",
                            wanted.job.value)});
    const Job* const job = jobs_.find(wanted.job);
    if ((i == 0 && reading_) || (job != nullptr && job->awaits_film())) {
      wanted.since = event.now;
      ++i;
    } else {
      wanted_.erase(wanted_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }
}

void Films::tick(const Event& event) {
  if (next_check_ && event.now >= *next_check_) {
    make_room(0, event.now);
  }
  give_up(event);
  if (event.now >= next_serve_) {
    serve(event);
  }
}

std::optional<Time> Films::next_deadline() const {
  std::optional<Time> next = next_check_;
  const auto by = [&](Time time) { next = std::min(next.value_or(time), time); };
  for (const Wanted& wanted : wanted_) {
    by(wanted.since + kTimeout);
  }
  if (!reading_ && !wanted_.empty()) {
    by(next_serve_);
  }
  return next;
}

}  // namespace lightmill

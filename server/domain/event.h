// Event as the coordinator's parts see it: its time, and the effects that it fills. Private to server/domain.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "common/base/clock.h"
#include "server/domain/effects.h"

namespace lightmill {

/// Job, worker or lease that a note is about.
struct Subject {
  JobId job{};
  std::string worker = {};
  LeaseId lease{};
};
inline Subject about(JobId job, std::string worker = {}, LeaseId lease = {}) {
  return {job, std::move(worker), lease};
}
inline Subject about(std::string worker) {
  return {JobId{}, std::move(worker)};
}

struct Event {
  Time now;
  std::int64_t unix_ms = 0;  ///< `now`, in milliseconds since 1970
  Effects& effects;

  void store(StoreOp op) const { effects.writes.push_back(std::move(op)); }
  void send(SessionId to, CoordinatorMessage message) const { effects.now.push_back({to, std::move(message)}); }
  void send_after_commit(SessionId to, CoordinatorMessage message) const {
    effects.after_commit.push_back({to, std::move(message)});
  }
  template <class... Args>
  void note(Note::Level level, Subject subject, fmt::format_string<Args...> format, Args&&... args) const {
    effects.notes.push_back({level, fmt::format(format, std::forward<Args>(args)...), subject.job,
                             std::move(subject.worker), subject.lease});
  }
  template <class... Args>
  void info(Subject subject, fmt::format_string<Args...> format, Args&&... args) const {
    note(Note::Level::info, std::move(subject), format, std::forward<Args>(args)...);
  }
  template <class... Args>
  void warn(Subject subject, fmt::format_string<Args...> format, Args&&... args) const {
    note(Note::Level::warning, std::move(subject), format, std::forward<Args>(args)...);
  }
};

}  // namespace lightmill

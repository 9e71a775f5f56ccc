// What the coordinator tells people of what it does, and whom that is about. Private to server/domain.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "server/domain/effects.h"

namespace lightmill {

/// Whom a note is about.
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
template <class... Args>
void note(Step& step, Note::Level level, Subject subject, fmt::format_string<Args...> format, Args&&... args) {
  step.notes.push_back(
      {level, fmt::format(format, std::forward<Args>(args)...), subject.job, std::move(subject.worker), subject.lease});
}

}  // namespace lightmill

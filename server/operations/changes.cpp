#include "server/operations/changes.h"

namespace lightmill {
namespace {

/// Adds a value that differs.
void add(std::string& text, std::string_view name, std::string_view before, std::string_view after) {
  if (before != after) {
    text += fmt::format("{}{} {} -> {}", text.empty() ? "" : ", ", name, before, after);
  }
}

std::string limit_text(auto limit) {
  return limit > 0 ? fmt::format("{}", limit) : "none";
}

std::string reason_text(const std::string& reason) {
  return reason.empty() ? "none" : fmt::format("'{}'", reason);
}

}  // namespace

std::string describe_change(const JobStatus& before, const JobStatus* after) {
  std::string text;
  add(text, "state", name_of(before.state), after == nullptr ? "deleted" : name_of(after->state));
  if (after != nullptr) {
    add(text, "priority", std::to_string(before.spec.priority), std::to_string(after->spec.priority));
    add(text, "samples", limit_text(before.spec.goal.samples), limit_text(after->spec.goal.samples));
    add(text, "seconds", limit_text(before.spec.goal.seconds), limit_text(after->spec.goal.seconds));
    add(text, "error", limit_text(before.spec.goal.error), limit_text(after->spec.goal.error));
  }
  return text;
}

std::string describe_change(const WorkerStatus& before, const WorkerStatus& after) {
  std::string text;
  add(text, "draining", before.draining ? "yes" : "no", after.draining ? "yes" : "no");
  add(text, "quarantine", reason_text(before.quarantine), reason_text(after.quarantine));
  return text;
}

}  // namespace lightmill

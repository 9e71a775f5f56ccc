#include "tests/simulation/refusal_checks.h"

#include <algorithm>

#include "tests/simulation/loss_checks.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {

const std::string& RefusalChecks::identity_of(std::size_t worker) const {
  return workers_[worker].identity;
}

void RefusalChecks::server_starts() {
  refusals_.clear();
}

void RefusalChecks::hello_came(const Stream& stream) {
  identities_[stream.name] = identity_of(stream.worker);
}

std::set<std::string> RefusalChecks::lost_in(const std::string& reason) const {
  constexpr std::string_view kBegin = "the last ones (";
  std::set<std::string> identities;
  for (std::size_t at = reason.find(kBegin); at != std::string::npos; at = reason.find(kBegin, at)) {
    at += kBegin.size();
    for (const std::size_t end = reason.find(')', at); at < end;) {
      const std::size_t next = std::min(reason.find(", ", at), end);
      if (const auto known = identities_.find(reason.substr(at, next - at)); known != identities_.end()) {
        identities.insert(known->second);
      }
      at = next + 2;
    }
  }
  return identities;
}

void RefusalChecks::refusal_came(const Stream& stream, const WorkerRefusal& refusal) {
  if (refusal.own_limits) {
    refusals_[refusal.job].left.insert(stream.name);
  } else {
    refusals_[refusal.job].came[stream.name] = identity_of(stream.worker);
  }
}

void RefusalChecks::note_heard(const Note& note) {
  constexpr std::string_view kBegin = "worker ", kRefuses = " refuses job ";
  const std::size_t at = note.text.find(kRefuses);
  if (!note.text.starts_with(kBegin) || at == std::string::npos) {
    return;
  }
  const JobId job{std::strtoull(note.text.c_str() + at + kRefuses.size(), nullptr, 10)};
  Refusals& of = refusals_[job];
  if (const auto came = of.came.find(note.text.substr(kBegin.size(), at - kBegin.size())); came == of.came.end()) {
    world_.fail(fmt::format("{}, but it sent no refusal", note.text));
  } else {
    of.heard.insert(came->second);
  }
}

void RefusalChecks::check_failed(const JobRecord& job) {
  const Refusals& of = refusals_[job.id];
  std::set<std::string> accusers = lost_in(job.reason);
  accusers.insert(of.heard.begin(), of.heard.end());
  if (accusers.size() > 1) {
    return;
  }
  if (accusers.empty()) {
    world_.fail(fmt::format("job {} failed, but no worker refused it: {}", job.id.value, job.reason));
  }
  const FilmOutline& film = *server_.coordinator()->outline(job.id);
  for (const auto& [session, stream] : server_.streams()) {
    const SimulatedWorker& other = workers_[stream->worker];
    const auto all = server_.coordinator()->workers(world_.now);
    const auto known = std::ranges::find(all, stream->name, &WorkerStatus::name);
    // The class of a job without samples may change.
    const bool suits = job.spec.allow_mixed || film.pixel_samples() == 0 || world_.bugs.hide_classes ||
                       job.fingerprint_class == other.fingerprint;
    // A worker that brings nothing is left out after a while.
    if (other.lies != Lies::idle && known != all.end() && known->connected && !known->draining &&
        known->quarantine.empty() && suits && !accusers.contains(identity_of(stream->worker)) &&
        !of.left.contains(stream->name)) {
      world_.fail(fmt::format("job {} failed after the refusal or losses of one identity while {} was connected: {}",
                              job.id.value, stream->name, job.reason));
    }
  }
}

void RefusalChecks::check_granted(SessionId to, JobId job) {
  const auto stream = server_.streams().find(to);
  const auto of = refusals_.find(job);
  if (stream != server_.streams().end() && of != refusals_.end() &&
      of->second.heard.contains(identity_of(stream->second->worker))) {
    world_.fail(fmt::format("{} gets job {}, but its identity refused it", stream->second->name, job.value));
  }
}

void RefusalChecks::check(const Effects& effects) {
  for (const Note& note : effects.notes) {
    note_heard(note);
  }
  for (const StoreOp& op : effects.writes) {
    const auto* const put = std::get_if<PutJob>(&op);
    if (put != nullptr && put->record.state == JobState::failed) {
      check_failed(put->record);
    }
    if (put != nullptr && put->record.finished_unix_ms != 0) {
      refusals_.erase(put->record.id);  // if it is reopened, all workers may get it again
    }
  }
  for (const std::vector<Outgoing>* channel : {&effects.now, &effects.after_commit}) {
    for (const Outgoing& message : *channel) {
      if (const auto* const grant = std::get_if<LeaseGrant>(&message.message)) {
        check_granted(message.to, grant->unit.job);
      } else if (const auto* const pilot = std::get_if<PilotGrant>(&message.message)) {
        check_granted(message.to, pilot->job);
      }
    }
  }
}

}  // namespace lightmill::simulation

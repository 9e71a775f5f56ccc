// Operations on the history of the farm since the coordinator started.
#include <algorithm>
#include <array>

#include "common/base/text.h"
#include "server/operations/handlers.h"
#include "server/operations/pages.h"

namespace lightmill::handlers {
namespace {

constexpr int kHour = 60 * 60;
constexpr std::array<std::pair<std::string_view, FarmEvents::Kind>, 5> kKinds{{{"", FarmEvents::Kind::all},
                                                                               {"all", FarmEvents::Kind::all},
                                                                               {"warnings", FarmEvents::Kind::warnings},
                                                                               {"jobs", FarmEvents::Kind::jobs},
                                                                               {"workers", FarmEvents::Kind::workers}}};

void to_wire(const HistorySample& sample, v1::FarmSample* out) {
  out->set_unix_ms(sample.unix_ms);
  out->set_seconds(sample.seconds);
  out->set_pixel_samples(sample.pixel_samples);
  out->set_workers(sample.workers);
  out->set_threads(sample.threads);
  out->set_busy_threads(sample.busy_threads);
  out->set_units(sample.leases);
  out->set_jobs_running(sample.jobs_running);
  out->set_jobs_waiting(sample.jobs_waiting);
}

void to_wire(const RecordedEvent& event, v1::FarmEvent* out) {
  out->set_number(event.number);
  out->set_unix_ms(event.unix_ms);
  out->set_text(event.note.text);
  out->set_warning(event.note.level == Note::Level::warning);
  out->set_job(event.note.job.value);
  out->set_worker(event.note.worker);
}

/// Intervals of ten seconds for spans up to an hour, else of five minutes.
Status get_history(OperationContext& operation, const v1::HistoryRequest& request, v1::FarmHistory* reply) {
  const FarmHistory& history = operation.context.activity.history;
  const int span = request.span() > 0 ? request.span() : kHour;
  reply->set_unix_ms(operation.context.unix_ms);
  reply->set_interval_seconds(to_seconds(FarmHistory::kInterval) * (span > kHour ? FarmHistory::kFineInCoarse : 1));
  const std::int64_t from_unix_ms = operation.context.unix_ms - std::int64_t{1'000} * span;
  for (const HistorySample& sample : span > kHour ? history.coarse() : history.fine()) {
    if (sample.unix_ms > from_unix_ms) {
      to_wire(sample, reply->add_samples());
    }
  }
  return ok_status();
}

/// Leaves out events about jobs that the caller may not see.
Status list_events(OperationContext& operation, const v1::EventsRequest& request, v1::FarmEvents* reply) {
  const auto* const kind = std::ranges::find(kKinds, request.kind(), [](const auto& each) { return each.first; });
  if (kind == kKinds.end()) {
    return invalid_argument("kind must be all, warnings, jobs or workers, got '{}'", printable(request.kind()));
  }
  FarmEvents::Filter filter;
  filter.kind = kind->second;
  filter.job = JobId{request.job()};
  filter.worker = request.worker();
  filter.admits = [&](const std::string& owner) { return may_see_job(operation.call.caller, owner); };
  LM_ASSIGN_OR_RETURN(filter.before, id_in(request.page_token()));
  LM_ASSIGN_OR_RETURN(const int size, page_size_of(request.page_size()));
  const FarmEvents::Page page = operation.context.activity.events.find(filter, static_cast<std::size_t>(size));
  for (const RecordedEvent& event : page.events) {
    to_wire(event, reply->add_events());
  }
  operation.entries = static_cast<std::size_t>(reply->events_size());
  if (page.next > 0) {
    reply->set_next_page_token(std::to_string(page.next));
  }
  return ok_status();
}

Status get_worker_history(OperationContext& operation, const v1::WorkerHistoryRequest& request,
                          v1::WorkerHistory* reply) {
  for (const WorkerSample& minute : operation.context.activity.history.of_worker(request.name())) {
    v1::WorkerSample* const out = reply->add_minutes();
    out->set_unix_ms(minute.unix_ms);
    out->set_seconds(minute.seconds);
    out->set_results(minute.results);
    out->set_leases_lost(minute.leases_lost);
    out->set_pixel_samples(static_cast<double>(minute.pixel_samples));
  }
  return ok_status();
}

}  // namespace

std::vector<Operation> history_operations() {
  return {
      {kListWorkers, "GET history?span=1..86400", on_farm(get_history), {.http_only = true}},
      {kListWorkers,
       "GET events?page_size=1..1000&page_token&job&worker&kind",
       on_farm(list_events),
       {.http_only = true}},
      {kListWorkers, "GET workers/{name}/history", on_farm(get_worker_history), {.http_only = true}},
  };
}

}  // namespace lightmill::handlers

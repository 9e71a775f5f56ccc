#include "server/web/look_back.h"

#include <array>
#include <limits>
#include <utility>

#include "common/base/text.h"
#include "lightmill/v1/web.pb.h"

namespace lightmill {
namespace {

constexpr int kHour = 60 * 60, kDay = 24 * kHour;
constexpr std::string_view kHistory = "history", kEvents = "events", kWorkers = "workers/", kOfWorker = "/history";
constexpr int kMostEvents = 1'000, kUsualEvents = 100;
constexpr std::array<std::pair<std::string_view, FarmEvents::Kind>, 4> kKinds{{{"all", FarmEvents::Kind::all},
                                                                               {"warnings", FarmEvents::Kind::warnings},
                                                                               {"jobs", FarmEvents::Kind::jobs},
                                                                               {"workers", FarmEvents::Kind::workers}}};

/// A number of the query from `least` to `most`; `usual` if it is not there.
template <class T>
Result<T> number_of(std::string_view query, std::string_view name, T least, T most, T usual) {
  const std::string_view text = query_value(query, name);
  const auto number = text.empty() ? std::optional<T>(usual) : parse_number<T>(text);
  return number && *number >= least && *number <= most
             ? Result<T>(*number)
             : invalid_argument("{} must be a number from {} to {}, got '{}'", name, least, most, printable(text));
}

Result<FarmEvents::Kind> kind_of(std::string_view query) {
  const std::string_view text = query_value(query, "kind");
  const auto* const found =
      std::ranges::find(kKinds, text.empty() ? "all" : text, [](const auto& kind) { return kind.first; });
  return found != kKinds.end()
             ? Result<FarmEvents::Kind>(found->second)
             : invalid_argument("kind must be all, warnings, jobs or workers, got '{}'", printable(text));
}

/// The message as JSON, whenever that is written.
template <class Message>
std::function<ApiReply()> written(Message message) {
  return [message = std::move(message)] { return json_reply(message); };
}

void to_wire(const FarmSample& sample, v1::FarmSample* out) {
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

void to_wire(const FarmEvent& event, v1::FarmEvent* out) {
  out->set_number(event.number);
  out->set_unix_ms(event.unix_ms);
  out->set_text(event.note.text);
  out->set_warning(event.note.level == Note::Level::warning);
  out->set_job(event.note.job.value);
  out->set_worker(event.note.worker);
}

/// `span` seconds of it: up to an hour by tens of seconds, up to a day by five minutes.
Result<LookBack> look_at_history(std::string_view query) {
  LM_ASSIGN_OR_RETURN(const int span, number_of<int>(query, "span", 1, kDay, kHour));
  return [span](FarmLoop::Turn& turn) {
    const FarmHistory& history = turn.past.history;
    const std::deque<FarmSample>& samples = span > kHour ? history.coarse() : history.fine();
    const std::int64_t from_unix_ms = turn.unix_ms - std::int64_t{1'000} * span;
    v1::FarmHistory out;
    out.set_unix_ms(turn.unix_ms);
    out.set_interval_seconds(to_seconds(FarmHistory::kInterval) * (span > kHour ? FarmHistory::kFineInCoarse : 1));
    for (const FarmSample& sample : samples) {
      if (sample.unix_ms > from_unix_ms) {
        to_wire(sample, out.add_samples());
      }
    }
    return written(std::move(out));
  };
}

Result<LookBack> look_at_events(std::string_view query, const Identity& caller) {
  constexpr auto kAny = std::numeric_limits<std::uint64_t>::max();
  FarmEvents::Filter filter;
  LM_ASSIGN_OR_RETURN(const int most, number_of<int>(query, "page_size", 1, kMostEvents, kUsualEvents));
  LM_ASSIGN_OR_RETURN(filter.before, number_of<std::uint64_t>(query, "page_token", 0, kAny, 0));
  LM_ASSIGN_OR_RETURN(filter.job.value, number_of<std::uint64_t>(query, "job", 0, kAny, 0));
  LM_ASSIGN_OR_RETURN(filter.kind, kind_of(query));
  LM_ASSIGN_OR_RETURN(filter.worker, percent_decoded(query_value(query, "worker")));
  filter.admits = [caller](const std::string& owner) { return may_see_job(caller, owner); };
  return [filter, most](FarmLoop::Turn& turn) {
    const FarmEvents::Page page = turn.past.events.find(filter, static_cast<std::size_t>(most));
    v1::FarmEvents out;
    for (const FarmEvent& event : page.events) {
      to_wire(event, out.add_events());
    }
    if (page.next > 0) {
      out.set_next_page_token(std::to_string(page.next));
    }
    return written(std::move(out));
  };
}

LookBack look_at_worker(std::string name) {
  return [name = std::move(name)](FarmLoop::Turn& turn) {
    v1::WorkerHistory out;
    for (const WorkerSample& minute : turn.past.history.of_worker(name)) {
      v1::WorkerSample* const wire = out.add_minutes();
      wire->set_unix_ms(minute.unix_ms);
      wire->set_seconds(minute.seconds);
      wire->set_results(minute.results);
      wire->set_units_lost(minute.leases_lost);
      wire->set_pixel_samples(static_cast<double>(minute.pixel_samples));
    }
    return written(std::move(out));
  };
}

}  // namespace

bool looks_back(std::string_view path) {
  return path == kHistory || path == kEvents ||
         (path.starts_with(kWorkers) && path.substr(kWorkers.size()).ends_with(kOfWorker));
}

Result<LookBack> look_back_at(std::string_view path, std::string_view query, const Identity& caller) {
  if (path == kHistory) {
    return look_at_history(query);
  }
  if (path == kEvents) {
    return look_at_events(query, caller);
  }
  path.remove_prefix(kWorkers.size());
  path.remove_suffix(kOfWorker.size());
  LM_ASSIGN_OR_RETURN(std::string name, percent_decoded(path));
  return look_at_worker(std::move(name));
}

}  // namespace lightmill

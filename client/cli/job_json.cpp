#include "client/cli/job_json.h"

#include <absl/strings/escaping.h>

#include <nlohmann/json.hpp>

#include "client/cli/progress.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

template <class T>
json null_unless(bool known, const T& value) {
  return known ? json(value) : json(nullptr);
}

json to_json(const google::protobuf::RepeatedPtrField<std::string>& texts) {
  return json(std::vector<std::string>(texts.begin(), texts.end()));
}

}  // namespace

json to_json(const v1::Job& job) {
  json history = json::array();
  for (const v1::ErrorPoint& point : job.history()) {
    history.push_back({{"samples", point.samples()},
                       {"worker_seconds", point.worker_seconds()},
                       {"rel_mse", point.error().rel_mse()},
                       {"half_width", point.error().half_width()}});
  }
  const v1::JobCounters& counters = job.counters();
  return {
      {"id", job.id()},
      {"name", job.name()},
      {"state", state_name(job.state())},
      {"reason", job.reason()},
      {"owner", job.owner()},
      {"host", job.host()},
      {"parent", null_unless(job.parent() != 0, job.parent())},
      {"priority", job.priority()},
      {"method", job.method()},
      {"method_chosen", job.method_notes().chosen()},
      {"method_candidates", to_json(job.method_notes().candidates())},
      {"method_reasons", to_json(job.method_notes().reasons())},
      {"notices", to_json(job.method_notes().notices())},
      {"seed", job.seed()},
      {"width", job.width()},
      {"height", job.height()},
      {"crop",
       {{"x", job.crop().x()}, {"y", job.crop().y()}, {"width", job.crop().width()}, {"height", job.crop().height()}}},
      {"goal",
       {{"samples", null_unless(job.goal().samples() > 0, job.goal().samples())},
        {"seconds", null_unless(job.goal().seconds() > 0, job.goal().seconds())},
        {"error", null_unless(job.goal().error() > 0, job.goal().error())},
        {"adaptive", job.goal().adaptive()}}},
      {"reached", null_unless(job.reached() != v1::GOAL_LIMIT_UNSPECIFIED, limit_name(job.reached()))},
      {"samples_done", job.samples_done()},
      {"samples_wanted", null_unless(job.samples_wanted() > 0, job.samples_wanted())},
      {"min_tile_samples", job.min_tile_samples()},
      {"max_tile_samples", job.max_tile_samples()},
      {"frame_samples", job.frame_samples()},
      {"fraction_done", fraction_done(job)},
      {"seconds", job.active_seconds()},
      {"worker_seconds", job.worker_seconds()},
      {"samples_per_second", job.samples_per_second()},
      {"eta_seconds", null_unless(job.eta_seconds() >= 0, job.eta_seconds())},
      {"error", job.has_error() ? json{{"rel_mse", job.error().rel_mse()}, {"half_width", job.error().half_width()}}
                                : json(nullptr)},
      {"history", history},
      {"counters",
       {{"results_merged", counters.results_merged()},
        {"results_duplicate", counters.results_duplicate()},
        {"leases_lost", counters.leases_lost()},
        {"copies_leased", counters.copies_leased()},
        {"non_finite", counters.non_finite()}}},
      {"audits",
       {{"share", job.audit_share()},
        {"audited", counters.results_audited()},
        {"unaudited", job.results_unaudited()},
        {"audits_lost", job.audits_lost()},
        {"one_identity", job.one_identity()},
        {"nodes_dropped", counters.nodes_dropped()}}},
      {"submitted_unix_ms", job.submitted_unix_ms()},
      {"finished_unix_ms", null_unless(job.finished_unix_ms() != 0, job.finished_unix_ms())},
      {"fingerprint_class", null_unless(!job.fingerprint_class().empty(), job.fingerprint_class())},
      {"allow_mixed", job.allow_mixed()},
      {"render_digest", null_unless(!job.render_digest().empty(), absl::BytesToHexString(job.render_digest()))},
      {"trace_id", null_unless(!job.trace_id().empty(), trace_text(job))},
  };
}

json to_json(const v1::Worker& worker) {
  return {
      {"name", worker.name()},
      {"host", worker.host()},
      {"pid", worker.pid()},
      {"threads", worker.threads()},
      {"fingerprint_class", worker.fingerprint_class()},
      {"draining", worker.draining()},
      {"samples_per_second", worker.samples_per_second()},
      {"leases", worker.leases()},
      {"connected_seconds", worker.connected_seconds()},
      {"results", worker.results()},
      {"leases_lost", worker.leases_lost()},
      {"quarantine", null_unless(!worker.quarantine().empty(), worker.quarantine())},
      {"connected", !worker.away()},
  };
}

json to_json(const v1::Job& job, const std::vector<std::string>& scene_notices) {
  json object = to_json(job);
  json notices = scene_notices;
  notices.insert(notices.end(), object["notices"].begin(), object["notices"].end());
  object["notices"] = std::move(notices);
  return object;
}

}  // namespace lightmill::cli

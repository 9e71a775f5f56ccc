#include <google/protobuf/util/time_util.h>

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/limits.h"
#include "lightmill/v1/worker_service.pb.h"

namespace lightmill {
namespace {

google::protobuf::Duration to_wire(Duration duration) {
  return google::protobuf::util::TimeUtil::NanosecondsToDuration(duration.count());
}

constexpr std::chrono::hours kMaxDuration(24);

Result<Duration> duration_from_wire(std::string_view field, const google::protobuf::Duration& duration) {
  constexpr std::int64_t kLimitSeconds = std::chrono::seconds(kMaxDuration).count();
  if (duration.seconds() < 0 || duration.seconds() > kLimitSeconds || duration.nanos() < 0 ||
      duration.nanos() >= 1'000'000'000) {
    return invalid_argument("{}: must be between 0 and {} s, got {} s and {} ns", field, kLimitSeconds,
                            duration.seconds(), duration.nanos());
  }
  return std::chrono::seconds(duration.seconds()) + std::chrono::nanoseconds(duration.nanos());
}

/// A finite float has an exponent that is not all ones. The loop has no branches, because it runs over every node that
/// the coordinator receives.
bool all_finite(std::span<const float> values) {
  std::uint32_t bad = 0;
  for (const float value : values) {
    bad |= (std::bit_cast<std::uint32_t>(value) & 0x7f80'0000u) == 0x7f80'0000u ? 1u : 0u;
  }
  return bad == 0;
}

/// The values of a node as a worker sends them.
Result<std::vector<float>> node_values(const std::string& bytes) {
  constexpr std::size_t kLimit = kMaxNodeValues * kTileSize * kTileSize * sizeof(float);
  LM_RETURN_IF_ERROR(check_length("values", bytes, kLimit));
  LM_ASSIGN_OR_RETURN(std::vector<float> values, floats_from_bytes(bytes));
  if (!all_finite(values)) {
    return invalid_argument("values: a node's sums must be finite");
  }
  return values;
}

template <class T>
Result<std::vector<LeaseId>> lease_list(const T& leases) {
  LM_RETURN_IF_ERROR(check_count("leases", leases.size(), kMaxListedLeases));
  std::vector<LeaseId> out;
  out.reserve(leases.size());
  for (const std::uint64_t lease : leases) {
    out.push_back(LeaseId{lease});
  }
  return out;
}

/// A message of one kind as a variant of all.
template <class Message, class One>
Result<Message> as_message(Result<One> one) {
  return one.ok() ? Result<Message>(*std::move(one)) : Result<Message>(one.status());
}

// ---- worker → coordinator ----

struct RequestWriter {
  v1::WorkRequest* out;

  void operator()(const WorkerHello& hello) const {
    v1::WorkerHello* wire = out->mutable_hello();
    wire->set_name(hello.name);
    wire->set_host(hello.host);
    wire->set_pid(hello.pid);
    wire->set_threads(hello.threads);
    wire->set_fingerprint_class(hello.fingerprint_class);
    wire->set_renderer_version(hello.renderer_version);
    for (const HeldLease& held : hello.held) {
      to_wire(held, wire->add_held());
    }
    wire->set_draining(hello.draining);
    wire->set_machine(hello.machine);
    wire->set_inspects(hello.inspects);
  }
  void operator()(const WorkerHeartbeat& heartbeat) const {
    v1::WorkerHeartbeat* wire = out->mutable_heartbeat();
    for (const LeaseId lease : heartbeat.leases) {
      wire->add_leases(lease.value);
    }
    if (heartbeat.longest_wait) {
      *wire->mutable_longest_wait() = to_wire(std::min<Duration>(*heartbeat.longest_wait, kMaxDuration));
    }
    for (const TileAtWork& tile : heartbeat.at_work) {
      v1::TileAtWork* at_work = wire->add_at_work();
      at_work->set_lease(tile.lease.value);
      at_work->set_tile(tile.tile.value);
      at_work->set_cpu_seconds(tile.cpu_seconds);
    }
  }
  void operator()(const WorkerResult& result) const {
    v1::WorkerResult* wire = out->mutable_result();
    wire->set_lease(result.lease.value);
    to_wire(result.key, wire->mutable_key());
    wire->set_values(result.node.values.data(), result.node.values.size() * sizeof(float));
    wire->set_non_finite(result.node.non_finite);
    wire->set_hash(hash_bytes(result.hash));
    wire->set_seconds(result.seconds);
    wire->set_render_digest(digest_bytes(result.render_digest));
    wire->set_trace_id(hash_bytes(result.trace));
    wire->set_tag(digest_bytes(result.tag));
  }
  void operator()(const WorkerReturn& message) const { out->mutable_lease_return()->set_lease(message.lease.value); }
  void operator()(const WorkerRefusal& refusal) const {
    out->mutable_refusal()->set_job(refusal.job.value);
    out->mutable_refusal()->set_reason(sentence(refusal.reason, kMaxRefusalBytes));
    out->mutable_refusal()->set_own_limits(refusal.own_limits);
  }
  void operator()(const WorkerDraining&) const { out->mutable_draining(); }
  void operator()(const PilotReport& report) const {
    v1::PilotReport* wire = out->mutable_pilot();
    wire->set_lease(report.lease.value);
    wire->set_choice(report.choice);
    for (const std::string& reason : report.reasons) {
      wire->add_reasons(sentence(reason));
    }
    wire->set_seconds(report.seconds);
    wire->mutable_shifts()->Assign(report.allocation.shifts().begin(), report.allocation.shifts().end());
  }
  void operator()(const InspectReport& report) const { to_wire(report, out->mutable_inspection()); }
};

Result<WorkerMessage> hello_from_wire(const v1::WorkerHello& hello) {
  LM_RETURN_IF_ERROR(check_length("hello.name", hello.name(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_length("hello.host", hello.host(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_length("hello.machine", hello.machine(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_length("hello.fingerprint_class", hello.fingerprint_class(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_length("hello.renderer_version", hello.renderer_version(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_count("hello.held", hello.held_size(), kMaxListedLeases));
  if (hello.name().empty()) {
    return invalid_argument("hello.name: must not be empty");
  }
  if (hello.threads() < 1) {
    return invalid_argument("hello.threads: must be at least 1, got {}", hello.threads());
  }
  WorkerHello out{hello.name(),
                  hello.host(),
                  hello.pid(),
                  hello.threads(),
                  hello.fingerprint_class(),
                  hello.renderer_version(),
                  {},
                  hello.draining(),
                  hello.machine(),
                  hello.inspects()};
  out.held.reserve(hello.held_size());
  for (const v1::HeldLease& held : hello.held()) {
    LM_ASSIGN_OR_RETURN(out.held.emplace_back(), from_wire(held));
  }
  return WorkerMessage(std::move(out));
}

Result<WorkerMessage> heartbeat_from_wire(const v1::WorkerHeartbeat& heartbeat) {
  WorkerHeartbeat out;
  LM_ASSIGN_OR_RETURN(out.leases, lease_list(heartbeat.leases()));
  if (heartbeat.has_longest_wait()) {
    LM_ASSIGN_OR_RETURN(out.longest_wait, duration_from_wire("heartbeat.longest_wait", heartbeat.longest_wait()));
  }
  LM_RETURN_IF_ERROR(check_count("heartbeat.at_work", heartbeat.at_work_size(), kMaxListedLeases));
  for (const v1::TileAtWork& tile : heartbeat.at_work()) {
    if (!(tile.cpu_seconds() >= 0)) {
      return invalid_argument("heartbeat.at_work.cpu_seconds: must not be negative, got {}", tile.cpu_seconds());
    }
    out.at_work.push_back({LeaseId{tile.lease()}, TileId{tile.tile()}, tile.cpu_seconds()});
  }
  return WorkerMessage(std::move(out));
}

Result<double> seconds_from_wire(std::string_view field, double seconds) {
  if (!std::isfinite(seconds) || seconds < 0) {
    return invalid_argument("{}: must be finite and not negative, got {}", field, seconds);
  }
  return seconds;
}

Result<WorkerMessage> result_from_wire(const v1::WorkerResult& result) {
  WorkerResult out;
  out.lease = LeaseId{result.lease()};
  LM_ASSIGN_OR_RETURN(out.key, from_wire(result.key()));
  out.node.range = out.key.range;
  LM_ASSIGN_OR_RETURN(out.node.values, node_values(result.values()));
  out.node.non_finite = result.non_finite();
  LM_ASSIGN_OR_RETURN(out.hash, hash_from_bytes(result.hash()));
  LM_ASSIGN_OR_RETURN(out.seconds, seconds_from_wire("seconds", result.seconds()));
  LM_ASSIGN_OR_RETURN(out.render_digest, digest_from_bytes(result.render_digest()));
  LM_ASSIGN_OR_RETURN(out.trace, trace_from_bytes(result.trace_id()));
  LM_ASSIGN_OR_RETURN(out.tag, digest_from_bytes(result.tag()));
  return WorkerMessage(std::move(out));
}

Result<WorkerMessage> pilot_from_wire(const v1::PilotReport& report) {
  PilotReport out;
  out.lease = LeaseId{report.lease()};
  out.choice = report.choice();
  LM_ASSIGN_OR_RETURN(out.reasons, texts_from_wire("pilot.reasons", report.reasons()));
  LM_ASSIGN_OR_RETURN(out.seconds, seconds_from_wire("pilot.seconds", report.seconds()));
  std::vector<std::int8_t> shifts;
  for (const std::int32_t shift : report.shifts()) {
    shifts.push_back(static_cast<std::int8_t>(std::clamp(shift, -128, 127)));
  }
  LM_ASSIGN_OR_RETURN(out.allocation, Allocation::of(std::move(shifts)));
  return WorkerMessage(std::move(out));
}

// ---- coordinator → worker ----

struct ResponseWriter {
  v1::WorkResponse* out;

  void operator()(const Welcome& welcome) const {
    v1::Welcome* wire = out->mutable_welcome();
    wire->set_epoch(welcome.epoch);
    *wire->mutable_heartbeat_interval() = to_wire(welcome.heartbeat_interval);
    *wire->mutable_lease_duration() = to_wire(welcome.lease_duration);
    wire->set_farm(hash_bytes(welcome.farm));
    wire->set_worker(welcome.worker);
  }
  void operator()(const JobDescription& job) const {
    v1::JobDescription* wire = out->mutable_job();
    wire->set_job(job.job.value);
    wire->set_render_digest(digest_bytes(job.render_digest));
    to_wire(job.settings, wire->mutable_settings());
  }
  void operator()(const LeaseGrant& grant) const { to_wire(grant, out->mutable_lease()); }
  void operator()(const ResultAck& ack) const {
    v1::ResultAck* wire = out->mutable_ack();
    for (const NodeKey& key : ack.keys) {
      to_wire(key, wire->add_keys());
    }
  }
  void operator()(const LeaseCancel& cancel) const {
    v1::LeaseCancel* wire = out->mutable_cancel();
    for (const LeaseId lease : cancel.leases) {
      wire->add_leases(lease.value);
    }
  }
  void operator()(const DrainRequest&) const { out->mutable_drain(); }
  void operator()(const PilotGrant& grant) const {
    v1::PilotGrant* wire = out->mutable_pilot();
    wire->set_lease(grant.lease.value);
    wire->set_job(grant.job.value);
    to_wire(grant.settings, wire->mutable_settings());
    wire->mutable_methods()->Assign(grant.methods.begin(), grant.methods.end());
    wire->set_allocate(grant.allocate);
  }
  void operator()(const Notice& notice) const { out->mutable_notice()->set_text(notice.text); }
  void operator()(const InspectGrant& grant) const { to_wire(grant, out->mutable_inspection()); }
  void operator()(const Dismissal& dismissal) const { out->mutable_dismissal()->set_reason(dismissal.reason); }
};

Result<CoordinatorMessage> welcome_from_wire(const v1::Welcome& welcome) {
  Welcome out;
  out.epoch = welcome.epoch();
  LM_ASSIGN_OR_RETURN(out.heartbeat_interval,
                      duration_from_wire("welcome.heartbeat_interval", welcome.heartbeat_interval()));
  LM_ASSIGN_OR_RETURN(out.lease_duration, duration_from_wire("welcome.lease_duration", welcome.lease_duration()));
  LM_ASSIGN_OR_RETURN(out.farm, hash_from_bytes(welcome.farm()));
  out.worker = welcome.worker();
  return CoordinatorMessage(std::move(out));
}

Result<CoordinatorMessage> job_from_wire(const v1::JobDescription& job) {
  JobDescription out;
  out.job = JobId{job.job()};
  LM_ASSIGN_OR_RETURN(out.render_digest, digest_from_bytes(job.render_digest()));
  LM_ASSIGN_OR_RETURN(out.settings, from_wire(job.settings()));
  return CoordinatorMessage(std::move(out));
}

Result<CoordinatorMessage> pilot_from_wire(const v1::PilotGrant& grant) {
  PilotGrant out;
  out.lease = LeaseId{grant.lease()};
  out.job = JobId{grant.job()};
  LM_ASSIGN_OR_RETURN(out.settings, from_wire(grant.settings()));
  LM_ASSIGN_OR_RETURN(out.methods, texts_from_wire("pilot.methods", grant.methods()));
  if (out.methods.empty()) {
    return invalid_argument("pilot.methods: at least one is expected");
  }
  out.allocate = grant.allocate();
  return CoordinatorMessage(std::move(out));
}

Result<CoordinatorMessage> ack_from_wire(const v1::ResultAck& ack) {
  LM_RETURN_IF_ERROR(check_count("ack.keys", ack.keys_size(), kMaxListedNodes));
  ResultAck out;
  out.keys.reserve(ack.keys_size());
  for (const v1::NodeKey& key : ack.keys()) {
    LM_ASSIGN_OR_RETURN(out.keys.emplace_back(), from_wire(key));
  }
  return CoordinatorMessage(std::move(out));
}

}  // namespace

void to_wire(const WorkerMessage& message, v1::WorkRequest* out) {
  std::visit(RequestWriter{out}, message);
}

Result<WorkerMessage> from_wire(const v1::WorkRequest& request) {
  switch (request.message_case()) {
    case v1::WorkRequest::kHello:
      return hello_from_wire(request.hello());
    case v1::WorkRequest::kHeartbeat:
      return heartbeat_from_wire(request.heartbeat());
    case v1::WorkRequest::kResult:
      return result_from_wire(request.result());
    case v1::WorkRequest::kLeaseReturn:
      return WorkerMessage(WorkerReturn{LeaseId{request.lease_return().lease()}});
    case v1::WorkRequest::kRefusal:
      LM_RETURN_IF_ERROR(check_length("refusal.reason", request.refusal().reason(), kMaxRefusalBytes));
      return WorkerMessage(
          WorkerRefusal{JobId{request.refusal().job()}, request.refusal().reason(), request.refusal().own_limits()});
    case v1::WorkRequest::kDraining:
      return WorkerMessage(WorkerDraining{});
    case v1::WorkRequest::kPilot:
      return pilot_from_wire(request.pilot());
    case v1::WorkRequest::kInspection:
      return as_message<WorkerMessage>(from_wire(request.inspection()));
    case v1::WorkRequest::MESSAGE_NOT_SET:
      break;
  }
  return invalid_argument("unknown kind of worker message");
}

void to_wire(const CoordinatorMessage& message, v1::WorkResponse* out) {
  std::visit(ResponseWriter{out}, message);
}

Result<CoordinatorMessage> from_wire(const v1::WorkResponse& response) {
  switch (response.message_case()) {
    case v1::WorkResponse::kWelcome:
      return welcome_from_wire(response.welcome());
    case v1::WorkResponse::kJob:
      return job_from_wire(response.job());
    case v1::WorkResponse::kLease:
      return as_message<CoordinatorMessage>(from_wire(response.lease()));
    case v1::WorkResponse::kAck:
      return ack_from_wire(response.ack());
    case v1::WorkResponse::kCancel: {
      LM_ASSIGN_OR_RETURN(std::vector<LeaseId> leases, lease_list(response.cancel().leases()));
      return CoordinatorMessage(LeaseCancel{std::move(leases)});
    }
    case v1::WorkResponse::kDrain:
      return CoordinatorMessage(DrainRequest{});
    case v1::WorkResponse::kPilot:
      return pilot_from_wire(response.pilot());
    case v1::WorkResponse::kNotice:
      LM_RETURN_IF_ERROR(check_length("notice.text", response.notice().text(), kMaxReasonBytes));
      return CoordinatorMessage(Notice{response.notice().text()});
    case v1::WorkResponse::kDismissal:
      LM_RETURN_IF_ERROR(check_length("dismissal.reason", response.dismissal().reason(), kMaxReasonBytes));
      return CoordinatorMessage(Dismissal{response.dismissal().reason()});
    case v1::WorkResponse::kInspection:
      return as_message<CoordinatorMessage>(from_wire(response.inspection()));
    case v1::WorkResponse::MESSAGE_NOT_SET:
      break;
  }
  return invalid_argument("unknown kind of coordinator message");
}

}  // namespace lightmill

#include "server/store/records.h"

#include <cstring>
#include <set>

#include "common/base/log.h"
#include "common/base/overloaded.h"
#include "common/base/text.h"
#include "common/wire/bytes.h"
#include "common/wire/enum_table.h"
#include "common/wire/farm_messages.h"
#include "lightmill/stored/v1/stored.pb.h"
#include "server/store/row_values.h"

namespace lightmill::stored {
namespace {

constexpr EnumTable<Proof, v1::StoredAction::Proof, 3> kProofs{
    {{Proof::none, v1::StoredAction::PROOF_NONE},
     {Proof::certificate, v1::StoredAction::PROOF_CERTIFICATE},
     {Proof::token, v1::StoredAction::PROOF_TOKEN}}};

// ---- values to messages ----

std::string spec_message(const JobRecord& job) {
  v1::StoredSpec out;
  to_wire(job.spec, out.mutable_request());
  to_wire(job.method_notes, out.mutable_method_notes());
  const std::span<const std::int8_t> shifts = job.allocation.shifts();
  out.set_allocation(std::string(shifts.begin(), shifts.end()));
  out.set_ends_with_page(job.spec.ends_with_page);
  return deterministic_bytes(out);
}

std::string state_message(const JobRecord& job) {
  v1::StoredJobState out;
  to_wire(job.spec.goal, out.mutable_goal());
  out.set_priority(job.spec.priority);
  out.set_state(to_wire(job.state));
  out.set_reason(job.reason);
  out.set_reached(to_wire(job.reached));
  out.set_fingerprint_class(job.fingerprint_class);
  out.set_submitted_unix_ms(job.submitted_unix_ms);
  out.set_finished_unix_ms(job.finished_unix_ms);
  for (const ErrorPoint& point : job.history) {
    to_wire(point, out.add_history());
  }
  return deterministic_bytes(out);
}

std::string progress_message(double active_seconds, double worker_seconds, const JobCounters& counters) {
  v1::StoredProgress out;
  out.set_active_seconds(active_seconds);
  out.set_worker_seconds(worker_seconds);
  to_wire(counters, out.mutable_counters());
  return deterministic_bytes(out);
}

std::string message_of(const TokenRecord& token) {
  v1::StoredToken out;
  out.set_name(token.name);
  out.set_roles(names_of(token.roles));
  out.set_hash(digest_bytes(token.hash));
  out.set_made_by(token.made_by);
  out.set_made_unix_s(token.made_unix_s);
  out.set_until_unix_s(token.until_unix_s);
  out.set_workers(token.enrolment.workers);
  out.set_enrolled(token.enrolment.enrolled);
  out.set_worker_seconds(token.enrolment.worker_seconds);
  out.set_enrolled_by(token.enrolled_by);
  return deterministic_bytes(out);
}

std::string message_of(const Action& action) {
  v1::StoredAction out;
  out.set_unix_ms(action.unix_ms);
  out.set_caller(action.caller);
  out.set_proof(code_of(kProofs, action.proof));
  out.set_token(action.token);
  out.set_peer(action.peer);
  out.set_operation(action.operation);
  out.set_job(action.job);
  out.set_about(action.about);
  out.set_outcome(static_cast<int>(action.outcome));
  out.set_message(action.message);
  out.set_change(action.change);
  return deterministic_bytes(out);
}

std::string message_of(const QuarantineRecord& record) {
  v1::StoredQuarantine out;
  out.set_identity(record.of.identity);
  out.set_host(record.host);
  out.set_reason(record.reason);
  out.set_since_unix_ms(record.since_unix_ms);
  return deterministic_bytes(out);
}

// ---- messages to values ----

const Status kNoMessage = data_loss("it is not a valid message");
const Status kWrongChecksum = data_loss("its checksum is wrong");

Status read_spec(std::string_view bytes, JobRecord& job) {
  v1::StoredSpec in;
  if (!parse_bytes(bytes, &in)) {
    return kNoMessage;
  }
  LM_ASSIGN_OR_RETURN(JobSpec spec, from_wire(in.request()));
  spec.goal = job.spec.goal;  // the current ones, which job.spec has already
  spec.priority = job.spec.priority;
  job.spec = std::move(spec);
  job.spec.ends_with_page = in.ends_with_page();
  LM_ASSIGN_OR_RETURN(job.method_notes, from_wire(in.method_notes()));
  LM_ASSIGN_OR_RETURN(job.allocation, allocation_in(in.allocation(), job.spec.settings));
  return ok_status();
}

Status read_state(std::string_view bytes, JobRecord& job) {
  v1::StoredJobState in;
  if (!parse_bytes(bytes, &in)) {
    return kNoMessage;
  }
  LM_ASSIGN_OR_RETURN(job.spec.goal, from_wire(in.goal()));
  LM_ASSIGN_OR_RETURN(job.state, from_wire(in.state()));
  LM_ASSIGN_OR_RETURN(job.reached, from_wire(in.reached()));
  job.spec.priority = in.priority();
  job.reason = in.reason();
  job.fingerprint_class = in.fingerprint_class();
  job.submitted_unix_ms = in.submitted_unix_ms();
  job.finished_unix_ms = in.finished_unix_ms();
  for (const lightmill::v1::ErrorPoint& point : in.history()) {
    job.history.push_back(from_wire(point));
  }
  return ok_status();
}

Result<TokenRecord> read_token(const std::string& id, std::string_view bytes) {
  v1::StoredToken in;
  if (!parse_bytes(bytes, &in)) {
    return kNoMessage;
  }
  TokenRecord token;
  token.id = id;
  token.name = in.name();
  LM_ASSIGN_OR_RETURN(token.roles, parse_roles(in.roles()));
  LM_ASSIGN_OR_RETURN(token.hash, digest_from_bytes(in.hash()));
  token.made_by = in.made_by();
  token.made_unix_s = in.made_unix_s();
  token.until_unix_s = in.until_unix_s();
  token.enrolment = {in.workers(), in.enrolled(), in.worker_seconds()};
  token.enrolled_by = in.enrolled_by();
  return token;
}

Result<Action> read_action(std::uint64_t number, std::string_view bytes) {
  v1::StoredAction in;
  if (!parse_bytes(bytes, &in)) {
    return kNoMessage;
  }
  LM_ASSIGN_OR_RETURN(const Proof proof, value_of(kProofs, in.proof(), "proof"));
  return Action{.number = number,
                .unix_ms = in.unix_ms(),
                .caller = in.caller(),
                .proof = proof,
                .token = in.token(),
                .peer = in.peer(),
                .operation = in.operation(),
                .job = in.job(),
                .about = in.about(),
                .outcome = static_cast<StatusCode>(in.outcome()),
                .message = in.message(),
                .change = in.change()};
}

}  // namespace

std::int64_t checksum_of(Table table, const Key& key, std::string_view message) {
  Xxh3Hasher hasher;
  const std::array<std::uint64_t, 3> head{static_cast<std::uint64_t>(table), key.number, key.name.size()};
  hasher.append(std::as_bytes(std::span(head)));
  hasher.append(as_byte_view(key.name));
  hasher.append(as_byte_view(message));
  return static_cast<std::int64_t>(hasher.finish().low);
}

// ---- writing ----

StoredSpecs::Kept StoredSpecs::find(JobId job) const {
  if (const auto change = changes_.find(job); change != changes_.end()) {
    return change->second;
  }
  const auto stored = stored_.find(job);
  return stored == stored_.end() ? Kept::none : stored->second;
}

void StoredSpecs::put(const JobRecord& job) {
  changes_[job.id] = job.method_notes.candidates.empty() ? Kept::decided : Kept::undecided;
}

void StoredSpecs::keep() {
  for (const auto& [job, kept] : changes_) {
    kept == Kept::none ? (void)stored_.erase(job) : (void)(stored_[job] = kept);
  }
  changes_.clear();
}

std::vector<RowChange> changes_of(const StoreOp& op, StoredSpecs& specs) {
  std::vector<RowChange> changes;
  const auto put = [&](Table table, Key key, std::string message) {
    changes.push_back({table, std::move(key), std::move(message)});
  };
  const auto drop = [&](Table table, Key key) { changes.push_back({table, std::move(key), std::nullopt}); };
  const auto put_progress = [&](JobId job, double active_seconds, double worker_seconds, const JobCounters& counters) {
    put(Table::job_progress, {job.value}, progress_message(active_seconds, worker_seconds, counters));
  };
  std::visit(
      Overloaded{[&](const PutJob& write) {
                   const JobRecord& job = write.record;
                   put(Table::jobs, {job.id.value}, state_message(job));
                   if (specs.is_missing(job)) {
                     specs.put(job);
                     put(Table::job_specs, {job.id.value}, spec_message(job));
                   }
                   put_progress(job.id, job.active_seconds, job.worker_seconds, job.counters);
                 },
                 [&](const PutProgress& write) {
                   put_progress(write.job, write.active_seconds, write.worker_seconds, write.counters);
                 },
                 [&](const DeleteJobRows& write) {
                   specs.drop(write.job);
                   drop(Table::jobs, {write.job.value});
                 },
                 [&](const PutToken& write) { put(Table::tokens, {.name = write.token.id}, message_of(write.token)); },
                 [&](const DropToken& write) { drop(Table::tokens, {.name = write.id}); },
                 [&](const PutAction& write) { put(Table::actions, {write.action.number}, message_of(write.action)); },
                 [&](const DropAction& write) { drop(Table::actions, {write.number}); },
                 [&](const PutQuarantine& write) {
                   put(Table::quarantine, {.name = write.record.of.worker}, message_of(write.record));
                 },
                 [&](const DropQuarantine& write) { drop(Table::quarantine, {.name = write.worker}); },
                 [](const auto&) {}},
      op);
  return changes;
}

void RowKeys::change(Table table, const Key& key, bool there) {
  const auto hash = static_cast<std::uint64_t>(checksum_of(table, key, {}));
  const auto index = static_cast<std::size_t>(table);
  if (hashes_[index].contains(hash) == there) {
    return;
  }
  there ? (void)hashes_[index].insert(hash) : (void)hashes_[index].erase(hash);
  sums_[index] ^= hash;
  changes_.emplace_back(table, hash);
}

void RowKeys::drop(Table table, const Key& key) {
  change(table, key, false);
  if (table == Table::jobs) {
    change(Table::job_specs, key, false);
    change(Table::job_progress, key, false);
  }
}

void RowKeys::keep() {
  changes_.clear();
  kept_ = sums_;
}

void RowKeys::forget() {
  for (const auto& [table, hash] : changes_) {
    std::set<std::uint64_t>& hashes = hashes_[static_cast<std::size_t>(table)];
    if (hashes.erase(hash) == 0) {
      hashes.insert(hash);
    }
  }
  changes_.clear();
  sums_ = kept_;
}

Status check_keys(const RowKeys::Sums& found, const RowKeys::Sums& written) {
  for (std::size_t table = 0; table < kTableCount; ++table) {
    if (found[table] != written[table]) {
      return failed_precondition("its table {} has lost rows, or still has deleted rows", kTables[table].name);
    }
  }
  return ok_status();
}

// ---- reading ----

void StateReader::take(Table table, const Key& key, std::string_view message, std::int64_t checksum) {
  const bool sound = checksum == checksum_of(table, key, message);
  switch (table) {
    case Table::jobs:
      return take_job(JobId{key.number}, message, sound);
    case Table::job_specs:
      return take_spec(JobId{key.number}, message, sound);
    case Table::job_progress:
      return take_progress(JobId{key.number}, message, sound);
    case Table::tokens:
      return take_token(key.name, message, sound);
    case Table::actions:
      return take_action(key.number, message, sound);
    case Table::quarantine:
      return take_quarantine(key.name, message, sound);
  }
}

JobRecord* StateReader::find(JobId job) {
  const auto at = places_.find(job);
  return at == places_.end() ? nullptr : &state_.jobs[at->second].record;
}

void StateReader::report(std::string what) {
  spdlog::error("{}", what);
  state_.damaged_entries.push_back(std::move(what));
}

void StateReader::take_job(JobId job, std::string_view message, bool sound) {
  places_[job] = state_.jobs.size();
  JobRecord& record = state_.jobs.emplace_back().record;
  record.id = job;
  if (const Status status = sound ? read_state(message, record) : kWrongChecksum; !status.ok()) {
    mark_damaged(job, lightmill::message_of(status));
  }
}

void StateReader::take_spec(JobId job, std::string_view message, bool sound) {
  if (JobRecord* const record = find(job)) {
    has_spec_[job] = true;
    if (const Status status = sound ? read_spec(message, *record) : kWrongChecksum; !status.ok()) {
      mark_damaged(job, lightmill::message_of(status));
    }
  }
}

void StateReader::take_progress(JobId job, std::string_view message, bool sound) {
  v1::StoredProgress in;
  JobRecord* const record = find(job);
  if (record != nullptr && sound && parse_bytes(message, &in)) {
    has_progress_[job] = true;
    record->active_seconds = in.active_seconds();
    record->worker_seconds = in.worker_seconds();
    record->counters = from_wire(in.counters());
  }
}

void StateReader::take_token(const std::string& id, std::string_view message, bool sound) {
  Result<TokenRecord> token = sound ? read_token(id, message) : kWrongChecksum;
  if (token.ok()) {
    state_.tokens.push_back(*std::move(token));
    return;
  }
  report(fmt::format("token {} is no longer valid: {}", printable(id, true), lightmill::message_of(token.status())));
  repairs_.push_back(DropToken{id});
}

void StateReader::take_action(std::uint64_t number, std::string_view message, bool sound) {
  Result<Action> action = sound ? read_action(number, message) : kWrongChecksum;
  if (action.ok()) {
    state_.actions.push_back(*std::move(action));
    return;
  }
  report(fmt::format("entry {} of the log is removed: {}", number, lightmill::message_of(action.status())));
  repairs_.push_back(DropAction{number});
}

void StateReader::take_quarantine(const std::string& worker, std::string_view message, bool sound) {
  v1::StoredQuarantine in;
  if (sound && parse_bytes(message, &in)) {
    state_.quarantine.push_back({{worker, in.identity()}, in.reason(), in.since_unix_ms(), in.host()});
    return;
  }
  report(fmt::format("worker {} stays in quarantine, but its identity and the reason are lost: the row is damaged",
                     printable(worker, true)));
  state_.quarantine.push_back({{worker, ""}, "the reason is lost: its row in the store was damaged", 0, ""});
  repairs_.push_back(PutQuarantine{state_.quarantine.back()});
}

void StateReader::finish(StoredSpecs& specs) {
  for (const StoredState::StoredJob& job : state_.jobs) {
    const JobId id = job.record.id;
    if (!has_spec_.contains(id)) {
      mark_damaged(id, "its specification is missing");
    }
    if (!condemned_.contains(id) && !has_progress_.contains(id)) {
      report(fmt::format("job {}: its times and counters are damaged and begin at 0", id.value));
      repairs_.push_back(PutProgress{id, 0, 0, {}});
    }
    if (has_spec_.contains(id)) {
      specs.put(job.record);
    }
  }
  for (const auto& [job, why] : condemned_) {
    spdlog::error("job {} is left out: its stored data is damaged: {}", job.value, why);
    state_.damaged_jobs.push_back(job);
  }
  std::erase_if(state_.jobs, [&](const auto& job) { return condemned_.contains(job.record.id); });
  specs.keep();
}

}  // namespace lightmill::stored

#include "server/runtime/records.h"

#include <unistd.h>

#include <array>

#include "common/base/log.h"

namespace lightmill {
namespace {

bool is_refusal(const Status& status) {
  return status.code() == StatusCode::kUnauthenticated || status.code() == StatusCode::kPermissionDenied ||
         status.code() == StatusCode::kResourceExhausted;
}

void keep(FarmLoop::Turn& turn, const Call& call, const About& about, StatusCode outcome, std::string message) {
  turn.keep({0, 0, call.caller.name, call.caller.proof, call.caller.token, call.peer,
             std::string(rule_of(call.rpc).method), about.job, about.text, outcome, std::move(message)});
}

std::string refusal_text(const Status& status, const Unwritten& unwritten) {
  std::string text;
  if (unwritten.repeated > 0) {
    text += fmt::format("({} more of the same since the last recorded one) ", unwritten.repeated);
  }
  if (unwritten.left_out > 0) {
    text += fmt::format("({} refusals before it are not recorded) ", unwritten.left_out);
  }
  return text + message_of(status);
}

std::string host_name() {
  std::array<char, 256> name{};
  return ::gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "?";
}

}  // namespace

void record_refusal(FarmLoop::Turn& turn, const Call& call, const About& about, const Status& status,
                    const Unwritten& unwritten) {
  std::string text = refusal_text(status, unwritten);
  spdlog::info("{}{} from {} is refused: {}", rule_of(call.rpc).method,
               about.job == 0 ? "" : fmt::format(" of job {}", about.job), call.peer, text);
  keep(turn, call, about, status.code(), std::move(text));
}

void record(FarmLoop::Turn& turn, const Gate& gate, const Call& call, const About& about, const Status& status) {
  if (status.ok() && about.was_there) {
    return;
  }
  if (status.ok()) {
    keep(turn, call, about, StatusCode::kOk, "");
  } else if (is_refusal(status)) {
    if (const std::optional<Unwritten> unwritten = gate.may_record_refusal(call, about, status)) {
      record_refusal(turn, call, about, status, *unwritten);
    }
  }
}

void record_login(FarmLoop::Turn& turn, const Gate& gate, const Identity& caller, const std::string& peer,
                  const Status& status) {
  const std::optional<Unwritten> unwritten = status.ok() ? Unwritten() : gate.may_record_refusal(caller);
  if (unwritten) {
    turn.keep({0, 0, caller.name, caller.proof, caller.token, peer, std::string(kLogin), 0, "", status.code(),
               status.ok() ? "" : refusal_text(status, *unwritten)});
  }
}

void record_own(FarmLoop::Turn& turn, std::string_view what, std::string about) {
  turn.keep({0, 0, "", Proof::none, "", host_name(), std::string(what), 0, std::move(about), StatusCode::kOk, ""});
}

Status check_store(const FarmLoop::Turn& turn) {
  return turn.no_store.empty()
             ? ok_status()
             : resource_exhausted("the farm cannot store anything now, so nothing is changed: {}; try again later",
                                  turn.no_store);
}

Status check_job_call(FarmLoop::Turn& turn, const Gate& gate, const Call& call, JobId job) {
  LM_ASSIGN_OR_RETURN(const std::string owner, turn.farm.owner(job));
  const Status status = check_job(call.caller, call.rpc, owner);
  if (!status.ok() && !rule_of(call.rpc).recorded) {
    record(turn, gate, call, {job.value}, status);
  }
  return status;
}

}  // namespace lightmill

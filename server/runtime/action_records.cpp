#include "server/runtime/action_records.h"

#include "common/base/address.h"
#include "common/base/log.h"
#include "common/security/caller.h"

namespace lightmill {
namespace {

Action action_of(const Identity& caller, const std::string& peer, std::string_view operation) {
  Action action;
  action.caller = caller.name;
  action.proof = caller.proof;
  action.token = caller.token;
  action.peer = peer;
  action.operation = operation;
  return action;
}

void keep(FarmLoop::TaskContext& context, const Call& call, const CallSubject& about, StatusCode outcome,
          std::string message) {
  Action action = action_of(call.caller, call.peer, call.rpc.method);
  action.job = about.job;
  action.about = about.text;
  action.outcome = outcome;
  action.message = std::move(message);
  action.change = outcome == StatusCode::kOk ? about.change : "";
  context.keep(std::move(action));
}

std::string refusal_text(const Status& status, const SuppressedRefusals& suppressed) {
  std::string text;
  if (suppressed.repeated > 0) {
    text += fmt::format("({} more of the same since the last recorded one) ", suppressed.repeated);
  }
  if (suppressed.left_out > 0) {
    text += fmt::format("({} refusals before it are not recorded) ", suppressed.left_out);
  }
  return text + message_of(status);
}

}  // namespace

void record_refusal(FarmLoop::TaskContext& context, const Call& call, const CallSubject& about, const Status& status,
                    const SuppressedRefusals& suppressed) {
  std::string text = refusal_text(status, suppressed);
  spdlog::info("{}{} from {} is refused: {}", call.rpc.method,
               about.job == 0 ? "" : fmt::format(" of job {}", about.job), call.peer, text);
  keep(context, call, about, status.code(), std::move(text));
}

void record(FarmLoop::TaskContext& context, const AccessControl& access, const Call& call, const CallSubject& about,
            const Status& status) {
  if (status.ok() && about.was_there) {
    return;
  }
  if (status.ok()) {
    keep(context, call, about, StatusCode::kOk, "");
  } else if (is_refusal(status)) {
    if (const std::optional<SuppressedRefusals> suppressed = access.may_record_refusal(call, about, status)) {
      record_refusal(context, call, about, status, *suppressed);
    }
  }
}

void record_login(FarmLoop::TaskContext& context, const AccessControl& access, const Identity& caller,
                  const std::string& peer, const Status& status) {
  const std::optional<SuppressedRefusals> suppressed =
      status.ok() ? SuppressedRefusals() : access.may_record_refusal(caller);
  if (suppressed) {
    Action action = action_of(caller, peer, kLogin);
    action.outcome = status.code();
    action.message = status.ok() ? "" : refusal_text(status, *suppressed);
    context.keep(std::move(action));
  }
}

void record_own(FarmLoop::TaskContext& context, std::string_view what, std::string about) {
  Action action = action_of({}, host_name(), what);
  action.about = std::move(about);
  context.keep(std::move(action));
}

Status check_job_call(FarmLoop::TaskContext& context, const AccessControl& access, const Call& call, JobId job) {
  LM_ASSIGN_OR_RETURN(const std::string owner, context.farm.owner(job));
  const Status status = check_job(call.caller, call.rpc, owner);
  if (!status.ok() && !call.rpc.recorded) {
    record(context, access, call, {job.value}, status);
  }
  return status;
}

}  // namespace lightmill

#include "server/web/web_change.h"

#include "common/base/check.h"
#include "common/wire/farm_messages.h"
#include "lightmill/v1/farm.pb.h"

namespace lightmill {

void make_change(FarmLoop::Turn& turn, const Gate& gate, const Call& call, const FarmReply& back,
                 const WebChange& change) {
  LM_CHECK(rule_of(call.rpc).recorded, "{} changes something, so it is to be recorded", rule_of(call.rpc).method);
  if (const Status storing = check_store(turn); !storing.ok()) {
    return back(error_reply(storing));
  }
  About about;
  Result<ApiReply> answer = change(turn, about);
  record(turn, gate, call, about, answer.status());
  if (!answer.ok()) {
    return back(error_reply(answer.status()));
  }
  turn.callers.push_back(
      [back, answer = *std::move(answer)](const Status& stored) { back(stored.ok() ? answer : error_reply(stored)); });
}

Result<ApiReply> job_reply(FarmLoop::Turn& turn, JobId job) {
  LM_ASSIGN_OR_RETURN(const JobStatus status, turn.farm.status(job, turn.now));
  v1::Job wire;
  to_wire(status, &wire);
  return json_reply(wire);
}

}  // namespace lightmill

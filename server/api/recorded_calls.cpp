#include "server/api/recorded_calls.h"

#include "common/base/check.h"
#include "server/api/grpc_status.h"
#include "server/api/pages.h"

namespace lightmill {

grpc::ServerUnaryReactor* run_change(FarmLoop& loop, const Gate& gate, grpc::CallbackServerContext* context,
                                     const Result<Call>& admitted, Change change) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (!admitted.ok()) {
    reactor->Finish(to_grpc(admitted.status()));
    return reactor;
  }
  LM_CHECK(rule_of(admitted->rpc).recorded, "{} changes something, so it is to be recorded",
           rule_of(admitted->rpc).method);
  const bool posted = loop.post([&gate, reactor, call = *admitted, change = std::move(change)](FarmLoop::Turn& turn) {
    if (const Status storing = check_store(turn); !storing.ok()) {
      return reactor->Finish(to_grpc(storing));
    }
    About about;
    const Status status = change(turn, call, about);
    record(turn, gate, call, about, status);
    if (!status.ok()) {
      reactor->Finish(to_grpc(status));
      return;
    }
    turn.callers.push_back([reactor](const Status& stored) { reactor->Finish(to_grpc(stored)); });
  });
  if (!posted) {
    reactor->Finish(busy());
  }
  return reactor;
}

}  // namespace lightmill

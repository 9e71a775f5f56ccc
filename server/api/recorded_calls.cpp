#include "server/api/recorded_calls.h"

#include "common/base/check.h"
#include "server/api/grpc_status.h"

namespace lightmill {
namespace {

void make_change(FarmLoop::Turn& turn, const Gate& gate, grpc::ServerUnaryReactor* reactor, const Call& call,
                 const Change& change) {
  About about;
  const Status status = change(turn, call, about);
  record(turn, gate, call, about, status);
  if (!status.ok()) {
    reactor->Finish(to_grpc(status));
    return;
  }
  turn.callers.push_back([reactor](const Status& stored) { reactor->Finish(to_grpc(stored)); });
}

}  // namespace

grpc::ServerUnaryReactor* run_change(FarmLoop& loop, const Gate& gate, grpc::CallbackServerContext* context,
                                     const Result<Call>& admitted, Change change, std::optional<JobId> with_film_of) {
  grpc::ServerUnaryReactor* reactor = context->DefaultReactor();
  if (!admitted.ok()) {
    reactor->Finish(to_grpc(admitted.status()));
    return reactor;
  }
  LM_CHECK(rule_of(admitted->rpc).recorded, "{} changes something, so it is to be recorded",
           rule_of(admitted->rpc).method);
  const bool posted =
      loop.post([&gate, reactor, call = *admitted, change = std::move(change), with_film_of](FarmLoop::Turn& turn) {
        if (const Status storing = check_store(turn); !storing.ok()) {
          return reactor->Finish(to_grpc(storing));
        }
        if (!with_film_of) {
          return make_change(turn, gate, reactor, call, change);
        }
        turn.with_film(*with_film_of, [&gate, reactor, call, change](FarmLoop::Turn& later, const Status& here) {
          here.ok() ? make_change(later, gate, reactor, call, change) : reactor->Finish(to_grpc(here));
        });
      });
  if (!posted) {
    reactor->Finish(busy());
  }
  return reactor;
}

}  // namespace lightmill

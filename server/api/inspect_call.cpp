// InspectScene: asked on the farm thread, answered when a worker has reported, forgotten when the caller is gone.
#include <atomic>

#include "common/wire/farm_messages.h"
#include "server/access/call_limits.h"
#include "server/api/grpc_gate.h"
#include "server/api/grpc_status.h"
#include "server/api/render_service.h"
#include "server/operations/submission.h"

namespace lightmill {
namespace {

/// One call; the farm's reply to it, and gRPC until it has done with it, keep it alive.
class InspectCall final : public grpc::ServerUnaryReactor, public std::enable_shared_from_this<InspectCall> {
 public:
  InspectCall(FarmLoop& loop, const AssetStore& assets, v1::InspectSceneResponse* reply)
      : loop_(loop), assets_(assets), reply_(reply) {}

  void start(const Result<Call>& call, const v1::InspectSceneRequest& wire) {
    self_ = shared_from_this();
    Result<InspectionRequest> request = call.ok() ? from_wire(wire) : call.status();
    const Status status = request.ok() ? check_files(*request, assets_) : request.status();
    if (!status.ok()) {
      return finish(to_grpc(status));
    }
    const bool posted = loop_.post(
        [self = self_, caller = caller_key(call->caller, call->peer), request = *request](FarmLoop::Turn& turn) {
          const auto told = [self](const Result<std::shared_ptr<const Inspection>>& found) { self->answer(found); };
          const Result<InspectionId> id = turn.inspect(caller, request, told);
          if (!id.ok()) {
            return self->finish(to_grpc(id.status()));
          }
          self->id_ = *id;
          if (self->finished_.load()) {
            turn.forget_inspection(*id);  // cancelled before it was asked for
          }
        });
    if (!posted) {
      finish(busy());
    }
  }
  void OnCancel() override {
    finish(grpc::Status(grpc::StatusCode::CANCELLED, "the caller is gone"));
    loop_.post_always([self = shared_from_this()](FarmLoop::Turn& turn) {
      if (self->id_) {
        turn.forget_inspection(*self->id_);
      }
    });
  }
  void OnDone() override { const std::shared_ptr<InspectCall> last = std::move(self_); }

 private:
  void answer(const Result<std::shared_ptr<const Inspection>>& found) {
    if (finished_.exchange(true)) {
      return;
    }
    if (found.ok()) {
      to_wire(**found, reply_);
    }
    Finish(to_grpc(found.status()));
  }
  void finish(const grpc::Status& status) {
    if (!finished_.exchange(true)) {
      Finish(status);
    }
  }

  FarmLoop& loop_;
  const AssetStore& assets_;
  v1::InspectSceneResponse* const reply_;  ///< gRPC's, until Finish
  std::optional<InspectionId> id_;         ///< the farm thread's
  std::atomic<bool> finished_ = false;
  std::shared_ptr<InspectCall> self_;
};

}  // namespace

RenderServiceImpl::Unary* RenderServiceImpl::InspectScene(Context* context, const v1::InspectSceneRequest* request,
                                                          v1::InspectSceneResponse* reply) {
  const auto call = std::make_shared<InspectCall>(loop_, assets_, reply);
  call->start(admit(gate_, *context, Rpc::inspect_scene), *request);
  return call.get();
}

}  // namespace lightmill

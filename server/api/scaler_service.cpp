#include "server/api/scaler_service.h"

#include "server/api/grpc_gate.h"
#include "server/api/grpc_status.h"
#include "server/api/refused.h"
#include "server/api/watch_registry.h"
#include "server/runtime/demand_hub.h"
#include "server/runtime/records.h"

namespace lightmill {
namespace {

using externalscaler::IsActiveResponse;

/// One listener's stream. offer and close come from the farm thread and whoever stops the server, the On… methods from
/// gRPC's.
class ActiveStream final : public grpc::ServerWriteReactor<IsActiveResponse>, public DemandSink, public ClosableWatch {
 public:
  ActiveStream(FarmLoop& loop, const Gate& gate, Call call, std::shared_ptr<WatchRegistry> registry)
      : loop_(loop), gate_(gate), call_(std::move(call)), registry_(std::move(registry)) {}

  bool closed() const override {
    const MutexLock lock(mutex_);
    return ending_;
  }
  bool writable() const override {
    const MutexLock lock(mutex_);
    return !writing_ && !ending_;
  }
  void offer(bool active) override {
    if (const Status holds = gate_.check_still_holds(call_.caller); !holds.ok()) {
      fail(holds);
      return;
    }
    const MutexLock lock(mutex_);
    if (ending_) {
      return;
    }
    response_.set_result(active);
    writing_ = true;
    call_.place->stands_still();
    StartWrite(&response_);
  }
  void fail(const Status& status) {
    const MutexLock lock(mutex_);
    end(to_grpc(status));
  }
  void close() override { fail(unavailable("the coordinator stops")); }

  void OnWriteDone(bool ok) override {
    call_.place->moves();
    {
      const MutexLock lock(mutex_);
      writing_ = false;
      if (ending_) {
        Finish(final_status_);
        return;
      }
      if (!ok) {
        end(grpc::Status(grpc::StatusCode::CANCELLED, "the client left"));
        return;
      }
    }
    loop_.poke();
  }
  void OnCancel() override { fail(make_error(StatusCode::kCancelled, "the client left")); }
  void OnDone() override {
    call_.place->call_ended();
    loop_.poke();             // the hub forgets closed streams
    registry_->remove(this);  // the last use of this object, but for the hub's
  }

 private:
  void end(const grpc::Status& status) LM_REQUIRES(mutex_) {
    if (ending_) {
      return;
    }
    ending_ = true;
    if (writing_) {
      final_status_ = status;
    } else {
      Finish(status);
    }
  }

  FarmLoop& loop_;
  const Gate& gate_;
  const Call call_;
  const std::shared_ptr<WatchRegistry> registry_;
  mutable Mutex mutex_;
  IsActiveResponse response_ LM_GUARDED_BY(mutex_);  // unchanged while writing_
  bool writing_ LM_GUARDED_BY(mutex_) = false;
  bool ending_ LM_GUARDED_BY(mutex_) = false;
  grpc::Status final_status_ LM_GUARDED_BY(mutex_);
};

}  // namespace

std::shared_ptr<WatchRegistry> ScalerServiceImpl::make_registry() {
  return std::make_shared<WatchRegistry>();
}

void ScalerServiceImpl::stop() {
  streams_->stop();
}

grpc::ServerWriteReactor<IsActiveResponse>* ScalerServiceImpl::StreamIsActive(grpc::CallbackServerContext* context,
                                                                              const externalscaler::ScaledObjectRef*) {
  Result<Call> call = admit(gate_, *context, Rpc::stream_is_active);
  if (!call.ok()) {
    return new Refused<grpc::ServerWriteReactor<IsActiveResponse>>(call.status());
  }
  auto stream = std::make_shared<ActiveStream>(loop_, gate_, std::move(*call), streams_);
  ActiveStream* reactor = stream.get();
  if (const Status status = streams_->add(reactor, stream); !status.ok()) {
    // The registry has taken it all the same: it owns every stream until OnDone.
    stream->fail(status);
    return reactor;
  }
  if (!loop_.post([stream](FarmLoop::Turn& turn) { turn.demand.add(stream); })) {
    stream->fail(busy());
  }
  return reactor;
}

}  // namespace lightmill

// Films on their way to clients: WatchJob as they grow, GetFilm whole.
#include "common/base/log.h"
#include "common/film/film.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "server/api/grpc_gate.h"
#include "server/api/grpc_status.h"
#include "server/api/refused.h"
#include "server/api/render_service.h"
#include "server/api/watch_registry.h"
#include "server/operations/film_messages.h"

namespace lightmill {
namespace {

// ---- watching ----

/// One watcher's stream. update and fail come from the farm thread, the On… methods from gRPC's.
class WatchStream final : public grpc::ServerWriteReactor<v1::WatchJobResponse>,
                          public WatchSink,
                          public ClosableWatch,
                          public std::enable_shared_from_this<WatchStream> {
 public:
  WatchStream(FarmLoop& loop, const Gate& gate, Call call, std::shared_ptr<WatchRegistry> registry)
      : loop_(loop), gate_(gate), call_(std::move(call)), registry_(std::move(registry)) {}

  bool closed() const override {
    const MutexLock lock(mutex_);
    return ending_;
  }
  bool writable() const override {
    const MutexLock lock(mutex_);
    return !writing_ && !ending_;
  }
  void offer(const WatchUpdate& update) override {
    if (const Status holds = gate_.check_still_holds(call_.caller); !holds.ok()) {
      fail(holds);
      return;
    }
    v1::WatchJobResponse response;
    to_wire(update.job, response.mutable_job());
    for (const auto& shared : update.tiles) {
      const TileSnapshot& tile = shared->tile;
      if (shared->preview.empty()) {
        shared->preview = float_bytes(mean_rgb(tile));
      }
      v1::PreviewTile* out = response.add_tiles();
      to_wire(tile.rect, out->mutable_rect());
      out->set_samples(tile.samples);
      out->set_rgb(shared->preview);
    }
    const std::size_t bytes = response.ByteSizeLong();
    const MutexLock lock(mutex_);
    if (ending_) {
      return;
    }
    loop_.traffic().previews_out += bytes;
    response_.Swap(&response);
    writing_ = true;
    last_ = update.last;
    call_.place->stands_still();
    StartWrite(&response_);
  }
  void fail(const Status& status) override {
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
      if (!ok || last_) {
        end(grpc::Status::OK);
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
  v1::WatchJobResponse response_ LM_GUARDED_BY(mutex_);  // unchanged while writing_
  bool writing_ LM_GUARDED_BY(mutex_) = false;
  bool last_ LM_GUARDED_BY(mutex_) = false;  // what is being written is the last message
  bool ending_ LM_GUARDED_BY(mutex_) = false;
  grpc::Status final_status_ LM_GUARDED_BY(mutex_);
};

// ---- fetching ----

/// Sends one film as it was at one moment. Deletes itself.
class FilmStream final : public grpc::ServerWriteReactor<v1::GetFilmResponse> {
 public:
  FilmStream(Call call, Traffic& traffic) : call_(std::move(call)), traffic_(traffic) {}

  /// On the farm thread.
  void take(JobId job, const FarmLoop::Turn& turn) {
    Result<FilmSnapshot> film = snapshot(turn.farm, job, turn.now);
    if (!film.ok()) {
      Finish(to_grpc(film.status()));
      return;
    }
    tiles_ = std::move(film->tiles);
    response_.mutable_header()->Swap(&film->header);
    write();
  }
  void refuse(const grpc::Status& status) { Finish(status); }

  void OnWriteDone(bool ok) override {
    if (!ok || next_ == tiles_.size()) {
      Finish(ok ? grpc::Status::OK : grpc::Status(grpc::StatusCode::CANCELLED, "the client left"));
      return;
    }
    TileSnapshot& tile = tiles_[next_++];
    response_.Clear();
    *response_.mutable_tile() = film_tile(tile);
    traffic_.films_out += response_.ByteSizeLong();
    tile.forest.clear();
    write();
  }
  void OnDone() override {
    call_.place->call_ended();
    delete this;
  }

 private:
  void write() {
    call_.place->stands_still();
    StartWrite(&response_);
  }

  const Call call_;
  Traffic& traffic_;
  std::vector<TileSnapshot> tiles_;
  std::size_t next_ = 0;
  v1::GetFilmResponse response_;
};

}  // namespace

std::shared_ptr<WatchRegistry> RenderServiceImpl::make_watch_registry() {
  return std::make_shared<WatchRegistry>();
}

void RenderServiceImpl::stop() {
  watches_->stop();
}

grpc::ServerWriteReactor<v1::WatchJobResponse>* RenderServiceImpl::WatchJob(Context* context,
                                                                            const v1::WatchJobRequest* request) {
  const Result<Call> call = admit(gate_, *context, Rpc::watch_job, {request->id()});
  if (!call.ok()) {
    return new Refused<grpc::ServerWriteReactor<v1::WatchJobResponse>>(call.status());
  }
  auto stream = std::make_shared<WatchStream>(loop_, gate_, *call, watches_);
  WatchStream* reactor = stream.get();
  if (const Status status = watches_->add(reactor, stream); !status.ok()) {
    // The registry has taken it all the same: it owns every stream until OnDone.
    stream->fail(status);
    return reactor;
  }
  const bool posted = loop_.post([&gate = gate_, job = JobId{request->id()}, tiles = request->tiles(), call = *call,
                                  stream](FarmLoop::Turn& turn) {
    if (const Status status = check_job_call(turn, gate, call, job); status.ok()) {
      turn.watchers.add(job, tiles, stream);
    } else {
      stream->fail(status);
    }
  });
  if (!posted) {
    stream->fail(busy());
  }
  return reactor;
}

grpc::ServerWriteReactor<v1::GetFilmResponse>* RenderServiceImpl::GetFilm(Context* context,
                                                                          const v1::GetFilmRequest* request) {
  const Result<Call> call = admit(gate_, *context, Rpc::get_film, {request->id()});
  if (!call.ok()) {
    return new Refused<grpc::ServerWriteReactor<v1::GetFilmResponse>>(call.status());
  }
  auto* stream = new FilmStream(*call, loop_.traffic());
  const bool posted =
      loop_.post([&gate = gate_, stream, call = *call, job = JobId{request->id()}](FarmLoop::Turn& turn) {
        if (const Status status = check_job_call(turn, gate, call, job); !status.ok()) {
          return stream->refuse(to_grpc(status));
        }
        turn.with_film(job, [stream, job](const FarmLoop::Turn& later, const Status& here) {
          here.ok() ? stream->take(job, later) : stream->refuse(to_grpc(here));
        });
      });
  if (!posted) {
    stream->refuse(to_grpc(busy()));
  }
  return stream;
}

}  // namespace lightmill

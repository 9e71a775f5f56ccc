// Streams of films: WatchJob sends changes, GetFilm the whole film.
#include "common/film/film.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "server/api/grpc_access.h"
#include "server/api/offer_stream.h"
#include "server/api/rejected_stream.h"
#include "server/api/render_service.h"
#include "server/operations/messages.h"
#include "server/runtime/action_records.h"

namespace lightmill {
namespace {

// ---- watching ----

class WatchStream final : public OfferStream<v1::WatchJobResponse, WatchSink> {
 public:
  WatchStream(Runtime& runtime, Call call, std::shared_ptr<WatchRegistry> registry)
      : OfferStream(runtime, std::move(call), std::move(registry)), traffic_(runtime.loop().traffic()) {}

  void offer(const WatchUpdate& update) override {
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
    traffic_.previews_out += write(std::move(response), update.last) ? bytes : 0;
  }

 private:
  Traffic& traffic_;
};

// ---- fetching ----

/// Sends a snapshot of one film. Deletes itself.
class FilmStream final : public grpc::ServerWriteReactor<v1::GetFilmResponse> {
 public:
  FilmStream(Call call, const AccessControl& access, Traffic& traffic)
      : call_(std::move(call)), access_(access), traffic_(traffic) {}

  /// On the farm thread.
  void take(JobId job, const FarmLoop::TaskContext& context) {
    Result<FilmSnapshot> film = snapshot(context.farm, job, context.now);
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
    access_.taken(call_.peer, 0, overhead_of_sent(response_.ByteSizeLong()));
    if (!ok || next_ == tiles_.size()) {
      call_.slot->call_ended();
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
    call_.slot->call_ended();
    delete this;
  }

 private:
  void write() {
    call_.slot->set_stalled();
    StartWrite(&response_);
  }

  const Call call_;
  const AccessControl& access_;
  Traffic& traffic_;
  std::vector<TileSnapshot> tiles_;
  std::size_t next_ = 0;
  v1::GetFilmResponse response_;
};

}  // namespace

grpc::ServerWriteReactor<v1::WatchJobResponse>* RenderServiceImpl::WatchJob(Context* rpc_context,
                                                                            const v1::WatchJobRequest* request) {
  const Result<Call> call = admit(runtime_.access(), *rpc_context, kWatchJob, {request->id()}, request->ByteSizeLong());
  if (!call.ok()) {
    return new RejectedStream<grpc::ServerWriteReactor<v1::WatchJobResponse>>(call.status());
  }
  const auto stream = std::make_shared<WatchStream>(runtime_, *call, watches_);
  return WatchStream::start(stream, [&access = runtime_.access(), job = JobId{request->id()}, tiles = request->tiles(),
                                     call = *call, stream](FarmLoop::TaskContext& context) {
    if (const Status status = check_job_call(context, access, call, job); status.ok()) {
      context.watchers.add(job, tiles, stream);
    } else {
      stream->fail(status);
    }
  });
}

grpc::ServerWriteReactor<v1::GetFilmResponse>* RenderServiceImpl::GetFilm(Context* rpc_context,
                                                                          const v1::GetFilmRequest* request) {
  const Result<Call> call = admit(runtime_.access(), *rpc_context, kGetFilm, {request->id()}, request->ByteSizeLong());
  if (!call.ok()) {
    return new RejectedStream<grpc::ServerWriteReactor<v1::GetFilmResponse>>(call.status());
  }
  auto* stream = new FilmStream(*call, runtime_.access(), runtime_.loop().traffic());
  const bool posted = runtime_.loop().post(
      [&access = runtime_.access(), stream, call = *call, job = JobId{request->id()}](FarmLoop::TaskContext& context) {
        if (const Status status = check_job_call(context, access, call, job); !status.ok()) {
          return stream->refuse(to_grpc(status));
        }
        context.with_film(job, [stream, job](const FarmLoop::TaskContext& later, const Status& here) {
          here.ok() ? stream->take(job, later) : stream->refuse(to_grpc(here));
        });
      });
  if (!posted) {
    stream->refuse(to_grpc(busy()));
  }
  return stream;
}

}  // namespace lightmill

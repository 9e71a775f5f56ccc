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

class WatchStream final : public OfferStream<v1::WatchJobRequest, v1::WatchJobResponse, WatchSink>,
                          public std::enable_shared_from_this<WatchStream> {
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
  void request_read() override {
    serve([stream = shared_from_this(), job = JobId{request().id()},
           tiles = request().tiles()](FarmLoop::TaskContext& context) {
      if (const Status status = check_job_call(context, stream->access(), stream->call(), job); status.ok()) {
        context.watchers.add(job, tiles, stream);
      } else {
        stream->fail(status);
      }
    });
  }

  Traffic& traffic_;
};

// ---- fetching ----

/// Sends a snapshot of one film. Deletes itself.
class FilmStream final : public RequestCall<v1::GetFilmRequest, v1::GetFilmResponse> {
 public:
  FilmStream(Runtime& runtime, Call call, RequestReads& reads) : runtime_(runtime), call_(std::move(call)) {
    call_.slot->set_stalled();
    read_request(reads, holder_of(call_.caller, call_.peer));
  }

  /// On the farm thread.
  void take(JobId job, const FarmLoop::TaskContext& context) {
    Result<FilmSnapshot> film = snapshot(context.farm, job, context.now);
    if (!film.ok()) {
      return fail(film.status());
    }
    tiles_ = std::move(film->tiles);
    response_.mutable_header()->Swap(&film->header);
    write();
  }
  void fail(const Status& status) override {
    call_.slot->call_ended();
    Finish(to_grpc(status));
  }

  void OnWriteDone(bool ok) override {
    if (!ok || next_ == tiles_.size()) {
      call_.slot->call_ended();
      Finish(ok ? grpc::Status::OK : grpc::Status(grpc::StatusCode::CANCELLED, "the client left"));
      return;
    }
    TileSnapshot& tile = tiles_[next_++];
    response_.Clear();
    *response_.mutable_tile() = film_tile(tile);
    runtime_.loop().traffic().films_out += response_.ByteSizeLong();
    tile.forest.clear();
    write();
  }
  void OnDone() override {
    call_.slot->call_ended();
    delete this;
  }

 private:
  void request_read() override {
    call_.slot->set_active();
    const bool posted = runtime_.loop().post([this, job = JobId{request().id()}](FarmLoop::TaskContext& context) {
      if (const Status status = check_job_call(context, runtime_.access(), call_, job); !status.ok()) {
        return fail(status);
      }
      context.with_film(job, [this, job](const FarmLoop::TaskContext& later, const Status& here) {
        here.ok() ? take(job, later) : fail(here);
      });
    });
    if (!posted) {
      fail(busy());
    }
  }
  void write() {
    call_.slot->set_stalled();
    StartWrite(&response_);
  }

  Runtime& runtime_;
  const Call call_;
  std::vector<TileSnapshot> tiles_;
  std::size_t next_ = 0;
  v1::GetFilmResponse response_;
};

}  // namespace

RenderServiceImpl::Watch* RenderServiceImpl::watch_job(Context& context) {
  Result<Call> call = admit(runtime_.access(), context, kWatchJob);
  if (!call.ok()) {
    return new RejectedStream<Watch>(call.status());
  }
  return WatchStream::start(std::make_shared<WatchStream>(runtime_, *std::move(call), watches_), shared_.reads);
}

RenderServiceImpl::Fetch* RenderServiceImpl::get_film(Context& context) {
  Result<Call> call = admit(runtime_.access(), context, kGetFilm);
  if (!call.ok()) {
    return new RejectedStream<Fetch>(call.status());
  }
  return new FilmStream(runtime_, *std::move(call), shared_.reads);
}

RenderServiceImpl::RenderServiceImpl(Runtime& runtime, CallResources& shared)
    : UnaryCalls(runtime, shared), runtime_(runtime), shared_(shared) {
  const auto mark = [this](const char* method, grpc::internal::MethodHandler* handler) {
    MarkMethodStreamed(method_index(v1::RenderService::service_full_name(), method), handler);
  };
  mark("DownloadAsset", new RequestCallHandler<v1::DownloadAssetRequest, v1::DownloadAssetResponse>(
                            [this](Context* context) { return download_asset(*context); }));
  mark("WatchJob", new RequestCallHandler<v1::WatchJobRequest, v1::WatchJobResponse>(
                       [this](Context* context) { return watch_job(*context); }));
  mark("GetFilm", new RequestCallHandler<v1::GetFilmRequest, v1::GetFilmResponse>(
                      [this](Context* context) { return get_film(*context); }));
}

}  // namespace lightmill

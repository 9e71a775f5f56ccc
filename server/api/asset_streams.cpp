// Streams of assets: uploads and downloads in chunks.
#include "common/base/log.h"
#include "common/wire/bytes.h"
#include "server/api/grpc_access.h"
#include "server/api/grpc_status.h"
#include "server/api/rejected_stream.h"
#include "server/api/render_service.h"

namespace lightmill {
namespace {

constexpr std::size_t kMaxChunkBytes = std::size_t{1} << 20;
constexpr std::size_t kSentChunkBytes = std::size_t{256} << 10;

/// Receives one asset. gRPC calls it with one event at a time. A thread for the disk handles the event, and asks for
/// the next one. Deletes itself.
class UploadStream final : public grpc::ServerReadReactor<v1::UploadAssetRequest> {
 public:
  UploadStream(Runtime& runtime, CallThreads& threads, Call call)
      : runtime_(runtime), threads_(threads), call_(std::move(call)) {
    read_next();
  }

  void OnReadDone(bool ok) override {
    call_.slot->set_active();
    boost::asio::post(threads_.disk, [this, ok] {
      const Status status = ok ? take() : complete();
      if (ok) {
        runtime_.access().taken(call_.peer, request_.ByteSizeLong(), UnreadBytes::kMessageOverhead);
      }
      if (!ok || !status.ok()) {
        upload_.reset();
        call_.slot->call_ended();
        Finish(to_grpc(status));
        return;
      }
      read_next();
    });
  }
  void OnDone() override {
    call_.slot->call_ended();
    delete this;
  }

 private:
  void read_next() {
    call_.slot->set_stalled();
    StartRead(&request_);
  }
  Status take() {
    LM_RETURN_IF_ERROR(runtime_.access().check_still_holds(call_.caller));
    if (upload_ == nullptr) {
      LM_ASSIGN_OR_RETURN(const Sha256 digest, digest_from_bytes(request_.digest()));
      LM_ASSIGN_OR_RETURN(upload_, runtime_.assets().start_upload(digest, uploader(call_.caller)));
    } else if (!request_.digest().empty()) {
      return invalid_argument("digest: only the first message has one");
    }
    if (request_.chunk().size() > kMaxChunkBytes) {
      return invalid_argument("chunk: {} bytes are more than the limit of {}", request_.chunk().size(), kMaxChunkBytes);
    }
    runtime_.loop().traffic().assets_in += request_.chunk().size();
    return upload_->append(as_byte_view(request_.chunk()));
  }
  Status complete() {
    return upload_ == nullptr ? invalid_argument("digest: nothing was uploaded") : upload_->finish();
  }

  Runtime& runtime_;
  CallThreads& threads_;
  const Call call_;
  v1::UploadAssetRequest request_;
  std::unique_ptr<AssetStore::Upload> upload_;
};

/// Sends one asset. gRPC calls it with one event at a time. A thread for the disk reads each piece. Deletes itself.
class DownloadStream final : public grpc::ServerWriteReactor<v1::DownloadAssetResponse> {
 public:
  DownloadStream(Runtime& runtime, CallThreads& threads, Call call, const std::string& digest_bytes)
      : runtime_(runtime), threads_(threads), call_(std::move(call)) {
    const Result<Sha256> digest = digest_from_bytes(digest_bytes);
    if (!digest.ok()) {
      Finish(to_grpc(with_context(digest.status(), "digest")));
      return;
    }
    digest_ = *digest;
    boost::asio::post(threads_.disk, [this] { open(); });
  }

  void OnWriteDone(bool ok) override {
    call_.slot->set_active();
    runtime_.access().taken(call_.peer, 0, overhead_of_sent(response_.ByteSizeLong()));
    if (ok) {
      boost::asio::post(threads_.disk, [this] { write_next(); });
    } else {
      Finish(grpc::Status(grpc::StatusCode::CANCELLED, "the client left"));
    }
  }
  void OnDone() override {
    call_.slot->call_ended();
    delete this;
  }

 private:
  void open() {
    Result<std::unique_ptr<AssetStore::Reader>> reader = runtime_.assets().open_asset(digest_);
    if (!reader.ok()) {
      const bool missing = reader.status().code() == StatusCode::kNotFound;
      if (missing && runtime_.access().take_request(call_.caller, call_.peer).ok()) {  // it costs a look at all jobs
        (void)runtime_.loop().post([digest = digest_](FarmLoop::TaskContext& context) {
          context.farm.asset_is_missing(digest, context.now, context.effects);
        });
      }
      Finish(to_grpc(missing ? reader.status() : unreadable(reader.status())));
      return;
    }
    reader_ = std::move(*reader);
    write_next();
  }
  void write_next() {
    if (const Status holds = runtime_.access().check_still_holds(call_.caller); !holds.ok()) {
      Finish(to_grpc(holds));
      return;
    }
    Result<std::string> chunk = reader_->next(kSentChunkBytes);
    if (!chunk.ok()) {
      Finish(to_grpc(chunk.status().code() == StatusCode::kDataLoss ? forget() : unreadable(chunk.status())));
      return;
    }
    if (chunk->empty()) {
      call_.slot->call_ended();
      Finish(to_grpc(sent_.finish() == digest_ ? ok_status() : forget()));
      return;
    }
    sent_.append(*chunk);
    runtime_.loop().traffic().assets_out += chunk->size();
    response_.set_chunk(std::move(*chunk));
    call_.slot->set_stalled();
    StartWrite(&response_);
  }

  /// Deletes a damaged asset, so that clients send it again. Others of the same jobs may be damaged, too.
  Status forget() {
    spdlog::error("asset {} was damaged in the store and is deleted: the next job with the same file uploads it again",
                  digest_.hex());
    runtime_.assets().forget(*reader_);
    runtime_.check_assets_of_same_jobs(digest_);
    return unavailable("asset {} was damaged in the farm's store: submit a job with the same file again",
                       digest_.hex());
  }
  /// UNAVAILABLE, so workers try again. An error of the disk or database does not fail a job.
  Status unreadable(const Status& why) const {
    spdlog::error("asset {} cannot be read: {}", digest_.hex(), message_of(why));
    return unavailable("asset {} cannot be read from the farm's store: {}", digest_.hex(), message_of(why));
  }

  Runtime& runtime_;
  CallThreads& threads_;
  const Call call_;
  Sha256 digest_;
  Sha256Hasher sent_;
  std::unique_ptr<AssetStore::Reader> reader_;
  v1::DownloadAssetResponse response_;
};

}  // namespace

grpc::ServerReadReactor<v1::UploadAssetRequest>* RenderServiceImpl::UploadAsset(Context* context,
                                                                                v1::UploadAssetResponse*) {
  const Result<Call> call = admit(runtime_.access(), *context, kUploadAsset);
  if (!call.ok()) {
    return new RejectedStream<grpc::ServerReadReactor<v1::UploadAssetRequest>>(call.status());
  }
  return new UploadStream(runtime_, threads_, *call);
}

grpc::ServerWriteReactor<v1::DownloadAssetResponse>* RenderServiceImpl::DownloadAsset(
    Context* context, const v1::DownloadAssetRequest* request) {
  const Result<Call> call = admit(runtime_.access(), *context, kDownloadAsset, {}, request->ByteSizeLong());
  if (!call.ok()) {
    return new RejectedStream<grpc::ServerWriteReactor<v1::DownloadAssetResponse>>(call.status());
  }
  return new DownloadStream(runtime_, threads_, *call, request->digest());
}

}  // namespace lightmill

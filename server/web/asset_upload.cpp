#include "server/web/asset_upload.h"

#include <boost/asio/post.hpp>
#include <boost/beast/http/buffer_body.hpp>

#include <algorithm>
#include <limits>
#include <memory>
#include <vector>

#include "server/runtime/runtime.h"
#include "server/runtime/stream_slots.h"

namespace lightmill {
namespace {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using boost::system::error_code;

/// Bytes of its asset that a connection holds.
constexpr std::size_t kPieceBytes = std::size_t{128} << 10;

/// Reads a piece, writes it, and reads the next. Nothing is read ahead, so the sender waits for the disk. Everything
/// runs on the web thread, except the functions of on_disk().
class AssetUpload final : public std::enable_shared_from_this<AssetUpload> {
 public:
  AssetUpload(const UploadContext& way, HeadParser&& head, const Sha256& digest, Call call, UploadDone done)
      : way_(way),
        digest_(digest),
        call_(std::move(call)),
        done_(std::move(done)),
        head_(head.get()),
        length_(head.content_length().value_or(0)),
        parser_(std::move(head)) {
    parser_.body_limit(std::numeric_limits<std::uint64_t>::max());  // the store has its own limits
    parser_.eager(true);                                            // a piece may need many reads
  }

  void start() {
    on_disk(&AssetUpload::open, [](AssetUpload& self) {
      self.began_ = SteadyClock::now();
      send_continue(self.way_.stream, self.head_, [upload = self.shared_from_this()] { upload->read_piece(); });
    });
  }

 private:
  Status open() {
    const std::string user = uploader(call_.caller);
    LM_RETURN_IF_ERROR(way_.assets.check_room(digest_, user, length_));
    LM_ASSIGN_OR_RETURN(upload_, way_.assets.start_upload(digest_, user));
    return ok_status();
  }

  void read_piece() {
    piece_.resize(kPieceBytes);
    parser_.get().body() = {piece_.data(), piece_.size(), true};
    // The time of the disk does not count. Fast data earlier does not allow a longer pause now.
    way_.stream.tcp().expires_at(std::min(began_ + body_timeout(way_.timeout, received_bytes_),
                                          SteadyClock::now() + body_timeout(way_.timeout, kPieceBytes)));
    call_.slot->set_stalled();
    fill_piece();
  }
  void fill_piece() {
    if (parser_.is_done()) {
      return take_piece({});
    }
    parse_more(way_.stream, way_.buffer, parser_, [self = shared_from_this()](error_code error) {
      if (!error) {
        return self->fill_piece();
      }
      self->take_piece(error == http::error::need_buffer ? error_code() : error);
    });
  }
  void take_piece(error_code error) {
    call_.slot->set_active();
    if (error) {
      asio::post(way_.disk, [upload = std::move(upload_)] {});  // deletes the written part from the disk
      return;
    }
    piece_.resize(kPieceBytes - parser_.get().body().size);
    received_bytes_ += piece_.size();
    way_.traffic.assets_in += piece_.size();
    asked_disk_ = SteadyClock::now();
    on_disk(&AssetUpload::write_piece, [](AssetUpload& self) {
      self.began_ += SteadyClock::now() - self.asked_disk_;
      return self.parser_.is_done() ? self.done_(ok_status(), true) : self.read_piece();
    });
  }
  Status write_piece() {
    LM_RETURN_IF_ERROR(way_.access.check_still_holds(call_.caller));  // a token may be revoked
    LM_RETURN_IF_ERROR(upload_->append(as_byte_view({piece_.data(), piece_.size()})));
    if (!parser_.is_done()) {
      return ok_status();
    }
    const Status status = upload_->finish();
    upload_.reset();
    return status;
  }

  /// Runs `work` on a thread that may wait for the disk. If it succeeds, runs `next` on the web thread.
  void on_disk(Status (AssetUpload::*work)(), void (*next)(AssetUpload&)) {
    asio::post(way_.disk, [self = shared_from_this(), work, next]() mutable {
      const Status status = ((*self).*work)();
      if (!status.ok()) {
        self->upload_.reset();
      }
      const WebStream::executor_type web = self->way_.stream.get_executor();
      asio::post(web, [self = std::move(self), status, next] {
        return status.ok() ? next(*self) : self->done_(status, self->parser_.is_done());
      });
    });
  }

  const UploadContext way_;
  const Sha256 digest_;
  const Call call_;  ///< holds the slot of the stream
  const UploadDone done_;
  const RequestHead head_;
  const std::uint64_t length_;  ///< according to the sender; 0: unknown
  http::request_parser<http::buffer_body> parser_;
  std::unique_ptr<AssetStore::Upload> upload_;
  std::vector<char> piece_;
  std::uint64_t received_bytes_ = 0;
  SteadyClock::time_point began_, asked_disk_;
};

}  // namespace

void receive_asset(const UploadContext& way, HeadParser&& head, const Sha256& digest, Call call, UploadDone done) {
  std::make_shared<AssetUpload>(way, std::move(head), digest, std::move(call), std::move(done))->start();
}

}  // namespace lightmill

// WebSocket of one viewer.
#include <boost/beast/core/flat_static_buffer.hpp>
#include <boost/beast/websocket.hpp>

#include "common/base/log.h"
#include "common/base/text.h"
#include "server/runtime/stream_slots.h"
#include "server/web/web_parts.h"

namespace lightmill {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace websocket = beast::websocket;
using boost::system::error_code;

constexpr std::size_t kMaxViewRequestBytes = 4 << 10;
constexpr std::size_t kWriteBufferBytes = 64 << 10;
constexpr auto kHandshakeTimeout = std::chrono::seconds(30);
constexpr auto kLiveTimeout = std::chrono::seconds(30);
constexpr std::size_t kMaxCloseReasonBytes = 100;

/// The part that fits in a close frame, cut at a character.
std::string reason_text(const Status& why) {
  std::string text = as_name(message_of(why));
  std::size_t end = std::min(text.size(), kMaxCloseReasonBytes);
  while (end > 0 && end < text.size() && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) {
    --end;
  }
  return text.substr(0, end);
}

class LiveSession final : public ViewerLink, public std::enable_shared_from_this<LiveSession> {
 public:
  LiveSession(WebParts& parts, WebStream&& stream, Call call, LiveHub::Holds holds)
      : parts_(parts), stream_(std::move(stream)), call_(std::move(call)), holds_(std::move(holds)) {}
  ~LiveSession() override {
    if (joined_) {
      parts_.hub.remove(*this);
    }
  }

  void start(const RequestHead& request) {
    stream_.set_option(websocket::stream_base::timeout{kHandshakeTimeout, kLiveTimeout, true});
    stream_.auto_fragment(false);
    stream_.write_buffer_bytes(kWriteBufferBytes);
    stream_.read_message_max(kMaxViewRequestBytes);
    stream_.binary(true);
    stream_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) {
        self->join();
      }
    });
  }

  bool busy() const override { return !writing_.empty() || closing_; }
  void send(MessageParts parts) override {
    writing_ = std::move(parts);
    std::vector<asio::const_buffer> buffers;
    for (const SharedBytes& part : writing_) {
      buffers.emplace_back(part->data(), part->size());
      parts_.traffic.previews_out += part->size();
    }
    stream_.async_write(buffers, [self = shared_from_this()](error_code error, std::size_t) {
      self->writing_.clear();
      if (!error) {
        self->parts_.hub.written(*self);
      }
    });
  }
  void close(const Status& why) override {
    if (!closing_) {
      close(why, static_cast<websocket::close_code>(kNoLongerAllowed));
    }
  }

 private:
  void join() {
    parts_.hub.add(*this, call_, holds_);
    joined_ = true;
    call_.slot->on_evict([mailbox = parts_.mailbox, weak = weak_from_this()] {
      mailbox->post([weak] {
        if (const auto self = weak.lock(); self != nullptr && !self->closing_) {
          self->close(resource_exhausted("another caller's page needs the connection"),
                      websocket::close_code::try_again_later);
        }
      });
    });
    read();
  }
  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) {
        self->closing_ = true;
        return;
      }
      const auto bytes = self->buffer_.cdata();
      const Status status =
          self->parts_.hub.ask(*self, std::string_view(static_cast<const char*>(bytes.data()), bytes.size()));
      self->buffer_.clear();
      if (status.ok()) {
        self->read();
      } else {
        self->close(status, websocket::close_code::policy_error);
      }
    });
  }
  void close(const Status& why, websocket::close_code code) {
    spdlog::info("the connection of a viewer is closed: {}", message_of(why));
    closing_ = true;
    stream_.async_close(websocket::close_reason(code, reason_text(why)), [self = shared_from_this()](error_code) {});
  }

  WebParts& parts_;
  websocket::stream<WebStream, false> stream_;  ///< without compression, because pictures are compressed
  const Call call_;
  const LiveHub::Holds holds_;
  beast::flat_static_buffer<kMaxViewRequestBytes> buffer_;
  MessageParts writing_;
  bool joined_ = false, closing_ = false;
};

}  // namespace

void start_live_session(WebParts& parts, WebStream&& stream, const RequestHead& request, Call call,
                        LiveHub::Holds holds) {
  std::make_shared<LiveSession>(parts, std::move(stream), std::move(call), std::move(holds))->start(request);
}

}  // namespace lightmill

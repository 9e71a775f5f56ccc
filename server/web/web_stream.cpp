#include "server/web/web_stream.h"

#include <boost/asio/ssl/stream_base.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>

namespace lightmill {

namespace asio = boost::asio;
namespace beast = boost::beast;

class WebStream::Layer {
 public:
  virtual ~Layer() = default;
  virtual beast::tcp_stream& tcp() = 0;
  virtual bool encrypted() const = 0;
  virtual void read_some(asio::mutable_buffer buffer, StreamHandler handler) = 0;
  virtual void write_some(std::span<const asio::const_buffer> buffers, StreamHandler handler) = 0;
  virtual void end(StreamHandler handler) = 0;
  virtual void tear_down(beast::role_type role, StreamHandler handler) = 0;
};

namespace {

class TcpLayer final : public WebStream::Layer {
 public:
  explicit TcpLayer(asio::ip::tcp::socket&& socket) : stream_(std::move(socket)) {}
  beast::tcp_stream& tcp() override { return stream_; }
  bool encrypted() const override { return false; }
  void read_some(asio::mutable_buffer buffer, StreamHandler handler) override {
    stream_.async_read_some(buffer, std::move(handler));
  }
  void write_some(std::span<const asio::const_buffer> buffers, StreamHandler handler) override {
    stream_.async_write_some(buffers, std::move(handler));
  }
  void end(StreamHandler handler) override {
    boost::system::error_code error;
    stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_send, error);
    handler(error);
  }
  void tear_down(beast::role_type role, StreamHandler handler) override {
    beast::websocket::async_teardown(role, stream_.socket(), std::move(handler));
  }

 private:
  beast::tcp_stream stream_;
};

class TlsLayer final : public WebStream::Layer {
 public:
  TlsLayer(WebStream&& below, std::shared_ptr<asio::ssl::context> context)
      : context_(std::move(context)), stream_(std::move(below), *context_) {}
  void shake_hands(asio::const_buffer begun, StreamHandler handler) {
    stream_.async_handshake(asio::ssl::stream_base::server, begun, std::move(handler));
  }
  beast::tcp_stream& tcp() override { return stream_.next_layer().tcp(); }
  bool encrypted() const override { return true; }
  void read_some(asio::mutable_buffer buffer, StreamHandler handler) override {
    stream_.async_read_some(buffer, std::move(handler));
  }
  void write_some(std::span<const asio::const_buffer> buffers, StreamHandler handler) override {
    stream_.async_write_some(buffers, std::move(handler));
  }
  void end(StreamHandler handler) override { stream_.async_shutdown(std::move(handler)); }
  void tear_down(beast::role_type, StreamHandler handler) override { stream_.async_shutdown(std::move(handler)); }

 private:
  const std::shared_ptr<asio::ssl::context> context_;
  beast::ssl_stream<WebStream> stream_;
};

}  // namespace

WebStream::WebStream(asio::ip::tcp::socket&& socket) : layer_(std::make_unique<TcpLayer>(std::move(socket))) {}

WebStream::WebStream(WebStream&&) noexcept = default;

WebStream::~WebStream() = default;

bool WebStream::encrypted() const {
  return layer_->encrypted();
}
beast::tcp_stream& WebStream::tcp() {
  return layer_->tcp();
}
WebStream::executor_type WebStream::get_executor() {
  return static_cast<asio::io_context&>(tcp().get_executor().context()).get_executor();
}

void WebStream::shake_hands(std::shared_ptr<asio::ssl::context> context, asio::const_buffer begun,
                            StreamHandler handler) {
  auto tls = std::make_unique<TlsLayer>(std::move(*this), std::move(context));
  TlsLayer& stream = *tls;
  layer_ = std::move(tls);
  stream.shake_hands(begun, std::move(handler));
}
void WebStream::read_some(asio::mutable_buffer buffer, StreamHandler handler) {
  layer_->read_some(buffer, std::move(handler));
}
void WebStream::write_some(std::span<const asio::const_buffer> buffers, StreamHandler handler) {
  layer_->write_some(buffers, std::move(handler));
}
void WebStream::end(StreamHandler handler) {
  layer_->end(std::move(handler));
}
void WebStream::tear_down(beast::role_type role, StreamHandler handler) {
  layer_->tear_down(role, std::move(handler));
}

}  // namespace lightmill

// One connection of a browser, encrypted or not: what Beast reads from and writes to.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl.hpp>
#include <boost/beast/websocket.hpp>
#include <boost/beast/websocket/ssl.hpp>

#include <memory>
#include <utility>
#include <variant>

namespace lightmill {

/// One type for both, so that all that is built on it is compiled once.
class WebStream {
 public:
  using Plain = boost::beast::tcp_stream;
  using executor_type = Plain::executor_type;

  /// Encrypted if there is a context.
  WebStream(boost::asio::ip::tcp::socket&& socket, std::shared_ptr<boost::asio::ssl::context> context)
      : stream_(context == nullptr ? Either(std::in_place_type<Plain>, std::move(socket))
                                   : Either(std::in_place_type<Encrypted>, std::move(socket), std::move(context))) {}

  bool encrypted() const { return std::holds_alternative<Encrypted>(stream_); }
  executor_type get_executor() { return tcp().get_executor(); }
  Plain& tcp() {
    Plain* const plain = std::get_if<Plain>(&stream_);
    return plain != nullptr ? *plain : boost::beast::get_lowest_layer(std::get<Encrypted>(stream_).stream);
  }
  const Plain& tcp() const { return const_cast<WebStream*>(this)->tcp(); }

  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    visit([&](auto& stream) { stream.async_read_some(buffers, std::forward<Handler>(handler)); });
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    visit([&](auto& stream) { stream.async_write_some(buffers, std::forward<Handler>(handler)); });
  }
  /// Of one that is encrypted; `begun` are bytes of it that were read already. The handler is told how many were used.
  template <class Buffers, class Handler>
  void async_handshake(const Buffers& begun, Handler&& handler) {
    std::get<Encrypted>(stream_).stream.async_handshake(boost::asio::ssl::stream_base::server, begun,
                                                        std::forward<Handler>(handler));
  }
  /// Of one that was to be encrypted, but whose other side does not.
  void give_up_encryption() { stream_.emplace<Plain>(tcp().release_socket()); }
  /// Says that nothing more comes.
  template <class Handler>
  void async_end(Handler&& handler) {
    if (Encrypted* const encrypted = std::get_if<Encrypted>(&stream_)) {
      encrypted->stream.async_shutdown(std::forward<Handler>(handler));
      return;
    }
    boost::system::error_code error;
    tcp().socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
    handler(error);
  }

  // What Beast's WebSocket looks for.
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, WebStream& stream, Handler&& handler) {
    using boost::beast::websocket::async_teardown;
    stream.visit([&](auto& each) { async_teardown(role, each, std::forward<Handler>(handler)); });
  }
  friend void beast_close_socket(WebStream& stream) { boost::beast::close_socket(stream.tcp()); }

 private:
  struct Encrypted {
    Encrypted(boost::asio::ip::tcp::socket&& socket, std::shared_ptr<boost::asio::ssl::context> with)
        : context(std::move(with)), stream(std::move(socket), *context) {}
    std::shared_ptr<boost::asio::ssl::context> context;
    boost::beast::ssl_stream<Plain> stream;
  };
  using Either = std::variant<Plain, Encrypted>;

  template <class Use>
  void visit(const Use& use) {
    if (Plain* const plain = std::get_if<Plain>(&stream_)) {
      use(*plain);
    } else {
      use(std::get<Encrypted>(stream_).stream);
    }
  }

  Either stream_;
};

}  // namespace lightmill

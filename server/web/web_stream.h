// One connection of a browser, encrypted or not. Beast reads from it and writes to it.
#pragma once

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>

#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

namespace lightmill {

/// A completion handler of any type. It takes an error and, optionally, a number of bytes. It has no executor: the
/// stream's applies. It is called at most once.
class StreamHandler {
 public:
  template <class Handler>
  StreamHandler(Handler handler) : held_(std::make_unique<Held<Handler>>(std::move(handler))) {}

  void operator()(boost::system::error_code error, std::size_t bytes = 0) {
    const std::unique_ptr<HeldBase> held = std::move(held_);  // the call may destroy this
    held->call(error, bytes);
  }

 private:
  struct HeldBase {
    virtual ~HeldBase() = default;
    virtual void call(boost::system::error_code error, std::size_t bytes) = 0;
  };
  template <class Handler>
  struct Held final : HeldBase {
    explicit Held(Handler&& taken) : handler(std::move(taken)) {}
    void call(boost::system::error_code error, std::size_t bytes) override {
      if constexpr (std::is_invocable_v<Handler&, boost::system::error_code, std::size_t>) {
        handler(error, bytes);
      } else {
        handler(error);
      }
    }
    Handler handler;
  };
  std::unique_ptr<HeldBase> held_;
};

/// Starts unencrypted. It erases the types of buffers and handlers, so TCP and TLS are compiled once, not for every
/// operation of Beast and every lambda. One read and one write at a time, on the thread of its io_context.
class WebStream {
 public:
  using executor_type = boost::asio::io_context::executor_type;
  using lowest_layer_type = WebStream;

  explicit WebStream(boost::asio::ip::tcp::socket&& socket);
  WebStream(WebStream&&) noexcept;
  ~WebStream();

  bool encrypted() const;
  /// The TCP stream, with its timeouts.
  boost::beast::tcp_stream& tcp();
  const boost::beast::tcp_stream& tcp() const { return const_cast<WebStream*>(this)->tcp(); }
  executor_type get_executor();
  lowest_layer_type& lowest_layer() { return *this; }

  /// Encrypts from now on. `begun`: bytes of the handshake that were read already. The handler gets the number of used
  /// bytes.
  template <class Handler>
  void async_handshake(std::shared_ptr<boost::asio::ssl::context> context, boost::asio::const_buffer begun,
                       Handler&& handler) {
    shake_hands(std::move(context), begun, std::forward<Handler>(handler));
  }
  /// Reads to the first buffer with room.
  template <class Buffers, class Handler>
  void async_read_some(const Buffers& buffers, Handler&& handler) {
    const boost::asio::mutable_buffer buffer = first_with_room(buffers);
    read_some(buffer, std::forward<Handler>(handler));
  }
  template <class Buffers, class Handler>
  void async_write_some(const Buffers& buffers, Handler&& handler) {
    gathered_.clear();
    const auto end = boost::asio::buffer_sequence_end(buffers);
    for (auto each = boost::asio::buffer_sequence_begin(buffers); each != end; ++each) {
      // After a part is written, Asio passes it as an empty buffer. Beast's TLS stream would write that alone, and Asio takes
      // a write of no bytes for the end.
      if (const boost::asio::const_buffer buffer = *each; buffer.size() != 0) {
        gathered_.push_back(buffer);
      }
    }
    write_some(gathered_, std::forward<Handler>(handler));
  }
  /// Ends sending.
  template <class Handler>
  void async_end(Handler&& handler) {
    end(std::forward<Handler>(handler));
  }

  // Functions that Beast's WebSocket requires.
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, WebStream& stream, Handler&& handler) {
    stream.tear_down(role, std::forward<Handler>(handler));
  }
  friend void beast_close_socket(WebStream& stream) { boost::beast::close_socket(stream.tcp()); }

  /// Transport of the bytes: TCP, or TLS over TCP.
  class Layer;

 private:
  template <class Buffers>
  static boost::asio::mutable_buffer first_with_room(const Buffers& buffers) {
    const auto end = boost::asio::buffer_sequence_end(buffers);
    for (auto each = boost::asio::buffer_sequence_begin(buffers); each != end; ++each) {
      if (const boost::asio::mutable_buffer buffer = *each; buffer.size() != 0) {
        return buffer;
      }
    }
    return {};
  }

  void shake_hands(std::shared_ptr<boost::asio::ssl::context> context, boost::asio::const_buffer begun,
                   StreamHandler handler);
  void read_some(boost::asio::mutable_buffer buffer, StreamHandler handler);
  void write_some(std::span<const boost::asio::const_buffer> buffers, StreamHandler handler);
  void end(StreamHandler handler);
  void tear_down(boost::beast::role_type role, StreamHandler handler);

  std::unique_ptr<Layer> layer_;
  std::vector<boost::asio::const_buffer> gathered_;  ///< what is being written
};

}  // namespace lightmill

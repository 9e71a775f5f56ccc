// Messages between a worker and its scene reader.
#pragma once

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <string>
#include <string_view>

#include "common/base/descriptor.h"
#include "common/base/status.h"

namespace lightmill {

/// The worker sends `start`, and one `reply` to each message except `report`. The reader sends all other messages,
/// `report` last. Several values are concatenated.
enum class ReaderMessage : std::uint32_t {
  start,   ///< a ReaderStart, the path of the image decoder, the packed request
  reply,   ///< the answer that the message's comment states, or an error
  fetch,   ///< the digest of a file; the reply is its bytes
  offer,   ///< digests of the scene's assets; the reply is those that the farm lacks
  asset,   ///< the digest and the bytes of one of those; the reply is empty
  report,  ///< the packed inspection, or an error
};

/// One end of a stream socket. Both programs are from the same build, so numbers are sent as they are in memory.
class ReaderSocket {
 public:
  /// Called repeatedly while a message is sent or awaited. An error ends the transfer.
  using MayContinue = std::function<Status()>;

  /// Messages with more than `most_bytes` are refused.
  ReaderSocket(Descriptor socket, std::uint64_t most_bytes, MayContinue may_continue = {})
      : socket_(std::move(socket)), most_bytes_(most_bytes), may_continue_(std::move(may_continue)) {}

  struct Received {
    ReaderMessage message{};
    Result<std::string> bytes;
  };
  /// Sends the parts as one message. UNAVAILABLE if the other end is closed.
  Status send(ReaderMessage message, std::initializer_list<std::string_view> parts);
  Status send_error(ReaderMessage message, const Status& error);
  /// UNAVAILABLE if the other end is closed.
  Result<Received> receive();
  /// Whether the other end was closed when a message was sent or awaited.
  bool closed() const { return closed_; }

 private:
  struct Head;
  Status send(const Head& head, std::initializer_list<std::string_view> parts);
  Status wait(short events) const;
  Status send_bytes(std::string_view bytes);
  Status receive_bytes(char* to, std::size_t size);

  Status other_end_closed();

  Descriptor socket_;
  bool closed_ = false;
  const std::uint64_t most_bytes_;
  const MayContinue may_continue_;
};

}  // namespace lightmill

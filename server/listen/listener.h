// A port of the coordinator: accepts connections and passes their sockets to a server.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <vector>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/access/connection_limiter.h"
#include "server/listen/unread_bytes.h"

namespace lightmill {

/// Owns the listening sockets and a thread that accepts. After an error of accept it tries again. The server closes the
/// connections; this checks whether they are still open. Thread-safe.
class Listener {
 public:
  /// Listens at HOST:PORT, for at most `most` connections. Port 0 takes a free one. 0.0.0.0 and [::] mean all addresses
  /// of the machine. UNAVAILABLE if the address cannot be bound. `option` is the option that gave the address.
  static Result<std::unique_ptr<Listener>> open(const std::string& listen, std::string_view option, std::size_t most);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  int port() const { return port_; }

  /// Bytes that connections may send while their caller is unknown. Beyond it, the ones that sent most are ended. The
  /// server may have to keep these bytes before it learns who sends them.
  struct UnknownBytes {
    std::uint64_t of_connection, of_all;
  };
  /// Before start(). Without it there is no limit.
  void limit_unknown(UnknownBytes limit) { unknown_bytes_ = limit; }
  /// Limits the bytes of known callers that are not taken(). Before start(). Without it there is no limit.
  void limit_unread(const UnreadBytes::Limits& limits) { unread_.emplace(limits); }
  /// Like UnreadBytes::taken, of the connection from ADDRESS:PORT.
  void taken(const std::string& peer, std::uint64_t bytes, std::uint64_t overhead);

  /// Takes ownership of a non-blocking socket, connected to ADDRESS:PORT.
  using Take = std::function<void(int socket, const std::string& peer)>;
  /// Starts to accept.
  void start(Take take);
  /// `take` is not called afterwards.
  void stop();

  /// See ConnectionLimiter::set_caller().
  Status set_caller(const std::string& peer, const Identity& caller);
  /// See ConnectionLimiter::clear_caller().
  void clear_caller(const std::string& peer);
  /// Connects to this port from inside. The connection is served despite the limits. Returns a non-blocking socket that
  /// is still connecting. UNAVAILABLE.
  Result<int> connect_to_self();

 private:
  using Id = ConnectionLimiter::Id;
  struct Socket {
    int fd = -1;
    std::uint64_t device = 0, inode = 0;
    bool is_open() const;
  };
  Listener(std::vector<int> sockets, int port, int wake, std::size_t most);
  void run();
  /// Whether all pending connections were accepted.
  bool accept_all(int listening);
  void arrive(int fd, const std::string& peer);
  void update();
  /// Drops closed connections, at most ten times per second.
  void sweep(Time now) LM_REQUIRES(mutex_);
  void shut(Id id) LM_REQUIRES(mutex_);
  void end_large_unknown() LM_REQUIRES(mutex_);
  void end_large_unread(Time now);

  const std::vector<int> sockets_;
  const int port_;
  const int wake_;  ///< an eventfd
  std::optional<UnknownBytes> unknown_bytes_;
  Take take_;
  Mutex mutex_;
  ConnectionLimiter limiter_ LM_GUARDED_BY(mutex_);
  std::unordered_map<Id, Socket> open_ LM_GUARDED_BY(mutex_);
  std::unordered_map<Id, std::string> waiting_ LM_GUARDED_BY(mutex_);  ///< their peers
  std::string own_ LM_GUARDED_BY(mutex_);  ///< peer of the last connect_to_self(), until it is accepted
  std::optional<UnreadBytes> unread_;      ///< used with mutex_ after start()
  Time swept_at_ LM_GUARDED_BY(mutex_){};
  Time count_unread_at_{};
  Time told_at_{};  ///< when the log last reported that accept fails
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace lightmill

// A port of the coordinator: accepts connections for a server that takes them as sockets.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <vector>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "server/access/connection_book.h"

namespace lightmill {

/// Owns the listening sockets and a thread that accepts. An error of accept is never final: it tries again. Of
/// connections it knows whether they are still open, as their server closes them. Thread-safe.
class Listener {
 public:
  /// Listens at HOST:PORT, for at most `most` connections. Port 0 takes a free one; 0.0.0.0 and [::] stand for all
  /// addresses of the machine. UNAVAILABLE if it cannot be bound; `option` is what the address was given by.
  static Result<std::unique_ptr<Listener>> open(const std::string& listen, std::string_view option, std::size_t most);
  ~Listener();
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  int port() const { return port_; }

  /// Owns the socket from then on: non-blocking, of a connection from ADDRESS:PORT.
  using Take = std::function<void(int socket, const std::string& peer)>;
  /// Begins to accept.
  void start(Take take);
  /// `take` is not called any more.
  void stop();

  /// As ConnectionBook::meet.
  Status meet(const std::string& peer, const Identity& caller);
  /// As ConnectionBook::part.
  void part(const std::string& peer);
  /// A socket that is connecting to this port from inside, non-blocking, which is served whatever the limits.
  /// UNAVAILABLE.
  Result<int> dial();

 private:
  using Id = ConnectionBook::Id;
  struct Socket {
    int fd = -1;
    std::uint64_t device = 0, inode = 0;
  };
  Listener(std::vector<int> sockets, int port, int wake, std::size_t most);
  void run();
  /// Whether all that came was taken.
  bool accept_all(int listening);
  void arrive(int fd, const std::string& peer);
  void look();
  /// Forgets connections that are closed; looks ten times a second at most.
  void sweep(Time now) LM_REQUIRES(mutex_);
  void shut(Id id) LM_REQUIRES(mutex_);

  const std::vector<int> sockets_;
  const int port_;
  const int wake_;  ///< an eventfd
  Take take_;
  Mutex mutex_;
  ConnectionBook book_ LM_GUARDED_BY(mutex_);
  std::unordered_map<Id, Socket> open_ LM_GUARDED_BY(mutex_);
  std::unordered_map<Id, std::string> waiting_ LM_GUARDED_BY(mutex_);  ///< their peers
  std::string own_ LM_GUARDED_BY(mutex_);                              ///< peer of the last dial, until it is accepted
  Time swept_at_ LM_GUARDED_BY(mutex_){};
  Time told_at_{};  ///< when the log was told that accept fails
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;
};

}  // namespace lightmill

// A port of the coordinator, over real loopback sockets.
#include "server/listen/listener.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <memory>
#include <sstream>
#include <utility>

#include "tests/support/process.h"

namespace lightmill {
namespace {

/// Waits for a thread fail after this time.
constexpr int kListenerTimeoutMs = 60'000;

class ClientSocket {
 public:
  explicit ClientSocket(const std::string& from = "127.0.0.1") : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const sockaddr_in own = address_of(from, 0);
    EXPECT_EQ(::bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
  }
  ~ClientSocket() { close(); }
  ClientSocket(ClientSocket&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  void connect(int port) const {
    const sockaddr_in server = address_of("127.0.0.1", port);
    EXPECT_EQ(::connect(fd_, reinterpret_cast<const sockaddr*>(&server), sizeof server), 0);
  }
  void close() {
    if (fd_ >= 0) {
      ::close(std::exchange(fd_, -1));
    }
  }
  void send(std::size_t bytes) const {
    const std::string text(bytes, 'x');
    EXPECT_EQ(::send(fd_, text.data(), bytes, MSG_NOSIGNAL), static_cast<ssize_t>(bytes));
  }
  bool is_ended_now() const {
    pollfd ended{fd_, POLLRDHUP, 0};
    return ::poll(&ended, 1, 0) == 1;
  }
  /// Waits until the other side has closed it.
  bool is_ended() const {
    pollfd ended{fd_, POLLRDHUP, 0};
    return ::poll(&ended, 1, kListenerTimeoutMs) == 1;
  }
  std::string name() const {
    sockaddr_in own{};
    socklen_t size = sizeof own;
    (void)::getsockname(fd_, reinterpret_cast<sockaddr*>(&own), &size);
    std::array<char, INET_ADDRSTRLEN> text{};
    ::inet_ntop(AF_INET, &own.sin_addr, text.data(), text.size());
    return fmt::format("{}:{}", text.data(), ntohs(own.sin_port));
  }

 private:
  static sockaddr_in address_of(const std::string& host, int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    ::inet_pton(AF_INET, host.c_str(), &address.sin_addr);
    return address;
  }
  int fd_;
};

/// A server that keeps all its sockets until the test closes them.
class KeepingServer {
 public:
  KeepingServer(const std::string& listen, std::size_t most, std::optional<Listener::UnknownBytes> unknown = {})
      : listener_(Listener::open(listen, "--listen", most).value()) {
    if (unknown) {
      listener_->limit_unknown(*unknown);
    }
    listener_->start([this](int socket, const std::string& peer) {
      const MutexLock lock(mutex_);
      sockets_.emplace_back(peer, socket);
      changed_.notify_all();
    });
  }
  ~KeepingServer() {
    listener_->stop();
    const MutexLock lock(mutex_);
    for (const auto& [peer, socket] : sockets_) {
      ::close(socket);
    }
  }
  Listener& listener() { return *listener_; }
  /// Waits until it has `count` sockets.
  bool has(std::size_t count) {
    const MutexLock lock(mutex_);
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(kListenerTimeoutMs);
    while (sockets_.size() < count && changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
    }
    return sockets_.size() == count;
  }
  std::vector<std::string> peers() {
    const MutexLock lock(mutex_);
    std::vector<std::string> names;
    for (const auto& [peer, socket] : sockets_) {
      names.push_back(peer);
    }
    return names;
  }
  void close_first() {
    const MutexLock lock(mutex_);
    ::close(sockets_.front().second);
    sockets_.erase(sockets_.begin());
  }

 private:
  Mutex mutex_;
  CondVar changed_;
  std::vector<std::pair<std::string, int>> sockets_ LM_GUARDED_BY(mutex_);
  const std::unique_ptr<Listener> listener_;
};

/// While it exists, this process can open no file.
class NoFiles {
 public:
  NoFiles() {
    EXPECT_EQ(::getrlimit(RLIMIT_NOFILE, &before_), 0);
    const rlimit none{3, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_NOFILE, &none), 0);
  }
  ~NoFiles() { EXPECT_EQ(::setrlimit(RLIMIT_NOFILE, &before_), 0); }
  NoFiles(const NoFiles&) = delete;
  NoFiles& operator=(const NoFiles&) = delete;

 private:
  rlimit before_{};
};

/// The number of times that other threads of this process have waited.
long waits_of_others() {
  rusage all{}, own{};
  EXPECT_EQ(::getrusage(RUSAGE_SELF, &all) + ::getrusage(RUSAGE_THREAD, &own), 0);
  return all.ru_nvcsw - own.ru_nvcsw;
}

/// The log of this process while the object exists.
class AllOfTheLog {
 public:
  AllOfTheLog() {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("all", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_)));
    spdlog::set_level(spdlog::level::debug);
    // Before it trusts the type of an object, UBSan makes a pipe. Once it trusts it, it needs no descriptors.
    spdlog::debug("port {} accepts connections: {}, {} ms", 1, "first", 1);
  }
  ~AllOfTheLog() {
    spdlog::set_default_logger(before_);
    spdlog::set_level(level_);
  }
  AllOfTheLog(const AllOfTheLog&) = delete;
  AllOfTheLog& operator=(const AllOfTheLog&) = delete;

  /// No other thread may log meanwhile.
  long lines_with(std::string_view words) const {
    long count = 0;
    std::istringstream lines(text_.str());
    for (std::string line; std::getline(lines, line);) {
      count += line.find(words) != std::string::npos;
    }
    return count;
  }

 private:
  const std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
  const spdlog::level::level_enum level_ = spdlog::get_level();
  std::ostringstream text_;
};

TEST(Listener, UnknownCallersCannotSendMuch) {
  KeepingServer server("127.0.0.1:0", 100, Listener::UnknownBytes{20'000, 30'000});
  std::vector<ClientSocket> clients(4);
  for (const ClientSocket& client : clients) {
    client.connect(server.listener().port());
  }
  ASSERT_TRUE(server.has(4));
  ClientSocket &known = clients[0], &large = clients[1], &larger = clients[2], &small = clients[3];
  EXPECT_TRUE(server.listener().set_caller(known.name(), anonymous_identity()).ok());
  known.send(40'000);
  large.send(20'001);
  EXPECT_TRUE(large.is_ended()) << "beyond the limit of a connection";
  small.send(12'000);
  larger.send(19'000);
  EXPECT_TRUE(larger.is_ended()) << "beyond the limit of all, with the other one";
  EXPECT_FALSE(small.is_ended_now());
  EXPECT_FALSE(known.is_ended_now());
}

TEST(Listener, AcceptsConnectionsThatCameWithoutFreeDescriptors) {
  const AllOfTheLog log;
  const long waits_before = waits_of_others();
  {
    KeepingServer server("127.0.0.1:0", 100);
    const ClientSocket before, meanwhile;
    before.connect(server.listener().port());
    ASSERT_TRUE(server.has(1));
    {
      const NoFiles none;
      meanwhile.connect(server.listener().port());
      EXPECT_FALSE(server.listener().connect_to_self().ok());
      const long before_tries = waits_of_others();
      EXPECT_TRUE(test::eventually([&] { return waits_of_others() > before_tries + 3; }));
      EXPECT_EQ(server.peers().size(), 1u);
    }
    EXPECT_TRUE(server.has(2));
  }
  const long tries = log.lines_with("cannot accept a connection: Too many open files");
  EXPECT_GT(tries, 1);
  EXPECT_LE(tries, waits_of_others() - waits_before) << "it waits before each try";
}

TEST(Listener, AnUnknownCallerBeyondAQuarterOfTheSlotsWaitsForItsAddress) {
  KeepingServer server("127.0.0.1:0", 8);
  std::vector<ClientSocket> clients(3);
  for (const ClientSocket& client : clients) {
    client.connect(server.listener().port());
  }
  const ClientSocket elsewhere("127.0.0.2");
  elsewhere.connect(server.listener().port());
  ASSERT_TRUE(server.has(3));
  EXPECT_EQ(server.peers(), (std::vector{clients[0].name(), clients[1].name(), elsewhere.name()}));
  server.close_first();
  ASSERT_TRUE(server.has(3));
  EXPECT_EQ(server.peers(), (std::vector{clients[1].name(), elsewhere.name(), clients[2].name()}));
}

TEST(Listener, AKnownCallerFreesItsSlotForAnUnknownOne) {
  KeepingServer server("127.0.0.1:0", 8);
  std::vector<ClientSocket> clients(3);
  for (const ClientSocket& client : clients) {
    client.connect(server.listener().port());
  }
  ASSERT_TRUE(server.has(2));
  EXPECT_TRUE(server.listener().set_caller(clients[0].name(), anonymous_identity()).ok());
  EXPECT_TRUE(server.has(3));
}

TEST(Listener, AnOldUnknownCallerMakesRoomForAWaitingOne) {
  KeepingServer server("127.0.0.1:0", 4);
  const ClientSocket first, second;
  first.connect(server.listener().port());
  ASSERT_TRUE(server.has(1));
  second.connect(server.listener().port());
  EXPECT_TRUE(first.is_ended());
  EXPECT_TRUE(server.has(2));
}

TEST(Listener, AConnectionFromInsideIsServedWhenAllSlotsAreTaken) {
  KeepingServer server("127.0.0.1:0", 1);
  const ClientSocket known, refused;
  known.connect(server.listener().port());
  ASSERT_TRUE(server.has(1));
  EXPECT_TRUE(server.listener().set_caller(known.name(), anonymous_identity()).ok());
  refused.connect(server.listener().port());
  EXPECT_TRUE(refused.is_ended());
  const Result<int> connected = server.listener().connect_to_self();
  ASSERT_TRUE(connected.ok()) << connected.status();
  EXPECT_TRUE(server.has(2));
  ::close(*connected);
}

TEST(Listener, TheWildcardAddressIncludesIPv4) {
  for (const std::string listen : {"0.0.0.0:0", "[::]:0"}) {
    KeepingServer server(listen, 8);
    const ClientSocket client;
    client.connect(server.listener().port());
    ASSERT_TRUE(server.has(1)) << listen;
    EXPECT_EQ(server.peers().front(), client.name());
    const Result<int> connected = server.listener().connect_to_self();
    ASSERT_TRUE(connected.ok()) << connected.status();
    EXPECT_TRUE(server.has(2)) << listen;
    ::close(*connected);
  }
}

TEST(Listener, AnAddressInUseIsRefusedWithItsOption) {
  KeepingServer server("127.0.0.1:0", 8);
  const auto again = Listener::open(fmt::format("127.0.0.1:{}", server.listener().port()), "--listen", 8);
  EXPECT_EQ(again.status().code(), StatusCode::kUnavailable);
  EXPECT_NE(message_of(again.status()).find("--listen"), std::string::npos) << again.status();
}

}  // namespace
}  // namespace lightmill

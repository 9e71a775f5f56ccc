// Floods of connections to a coordinator with few file descriptors. Callers from other addresses are served meanwhile,
// and callers from the same address soon.
#include <arpa/inet.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/integration/health.h"
#include "tests/integration/secure_farm.h"
#include "tests/integration/web_farm.h"
#include "tests/support/recovery.h"

namespace lightmill::test {
namespace {

/// The coordinator can have 256 open files.
Launch with_few_files() {
  return {"127.0.0.1", {"/bin/sh", "-c", "ulimit -n 256; exec \"$@\"", "sh"}, {}};
}
constexpr int kFlood = 300;
/// Connection limits of gRPC: all connections, and unknown callers of one address.
constexpr int kConnections = 84, kUnknownCallers = 21;

/// Connections that send `words` and then nothing.
class Flood {
 public:
  Flood(int port, const std::string& from, int count, const std::string& words = "") {
    for (int i = 0; i < count; ++i) {
      const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
      sockaddr_in own{}, server{};
      own.sin_family = server.sin_family = AF_INET;
      ::inet_pton(AF_INET, from.c_str(), &own.sin_addr);
      ::inet_pton(AF_INET, "127.0.0.1", &server.sin_addr);
      server.sin_port = htons(static_cast<std::uint16_t>(port));
      EXPECT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
      EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&server), sizeof server), 0);
      (void)::send(socket, words.data(), words.size(), MSG_NOSIGNAL);
      sockets_.push_back(socket);
    }
  }
  ~Flood() { end(); }
  Flood(const Flood&) = delete;
  Flood& operator=(const Flood&) = delete;
  void end() {
    for (const int socket : std::exchange(sockets_, {})) {
      ::close(socket);
    }
  }
  /// The number that the other side has closed.
  int closed() const {
    return static_cast<int>(std::ranges::count_if(sockets_, [](int socket) { return is_closed(socket); }));
  }
  bool first_is_closed() const { return is_closed(sockets_.front()); }

 private:
  static bool is_closed(int socket) {
    pollfd ended{socket, POLLRDHUP, 0};
    return ::poll(&ended, 1, 0) == 1;
  }
  std::vector<int> sockets_;
};

int port_of(const std::string& address) {
  return std::stoi(address.substr(address.rfind(':') + 1));
}

std::shared_ptr<grpc::Channel> channel_to(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

bool answers(const std::shared_ptr<grpc::Channel>& channel) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(2));
  v1::ListJobsResponse response;
  return v1::RenderService::NewStub(channel)->ListJobs(&context, {}, &response).ok();
}

/// Calls over new connections until one gets an answer.
template <class Open>
bool answers_again(const std::string& what, const Open& open) {
  return recovers(what, [&] { return answers(open()); });
}

/// Lowers a process's limit of open files, so that it gets no new ones. Restores the limit at its end.
class NoDescriptors {
 public:
  explicit NoDescriptors(pid_t process) : process_(process) {
    rlimit none{};
    EXPECT_EQ(::prlimit(process, RLIMIT_NOFILE, nullptr, &before_), 0);
    none = {8, before_.rlim_max};
    EXPECT_EQ(::prlimit(process, RLIMIT_NOFILE, &none, nullptr), 0);
  }
  ~NoDescriptors() { EXPECT_EQ(::prlimit(process_, RLIMIT_NOFILE, &before_, nullptr), 0); }
  NoDescriptors(const NoDescriptors&) = delete;
  NoDescriptors& operator=(const NoDescriptors&) = delete;

 private:
  const pid_t process_;
  rlimit before_{};
};

TEST(Descriptors, AFloodFromAnotherAddressBlocksNoCaller) {
  Farm farm({}, with_few_files());
  const auto open = [&] { return channel_to(farm.address()); };
  Flood flood(port_of(farm.address()), "127.0.0.2", kFlood);
  EXPECT_TRUE(answers_again("during a flood from another address", open));
  flood.end();
  EXPECT_TRUE(answers_again("after it", open));
}

TEST(Descriptors, AFloodFromTheSameAddressKeepsKnownCallersAndMakesRoom) {
  Farm farm({}, with_few_files());
  const auto open = [&] { return channel_to(farm.address()); };
  std::vector<std::shared_ptr<grpc::Channel>> known;
  for (int i = 0; i < 2 * kUnknownCallers; ++i) {
    known.push_back(open());
    EXPECT_TRUE(answers(known.back())) << i;
  }
  const Flood flood(port_of(farm.address()), "127.0.0.1", kFlood);
  EXPECT_TRUE(answers_again("during a flood from the same address", open));
  EXPECT_GE(flood.closed(), kFlood - kConnections + kUnknownCallers)
      << "connections beyond the limit, and the first that timed out";
  for (const auto& channel : known) {
    EXPECT_EQ(channel->GetState(false), GRPC_CHANNEL_READY);
    EXPECT_TRUE(answers(channel));
  }
}

TEST(Descriptors, SilentConnectionsDoNotBlockAnEncryptedPort) {
  SecureFarm secure({}, with_few_files());
  const KeyAndCertificate ada = secure.person("ada", {Role::submit});
  const auto open = [&] { return secure.channel(ada); };
  Flood flood(port_of(secure.farm().address()), "127.0.0.2", kFlood);
  EXPECT_TRUE(answers_again("during a flood of an encrypted port", open));
  flood.end();
  EXPECT_TRUE(answers_again("after it", open));
}

TEST(Descriptors, HalfSentRequestsDoNotBlockThePage) {
  WebFarm farm({}, with_few_files());
  const Flood flood(farm.port(), "127.0.0.2", kFlood, "GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Half");
  EXPECT_TRUE(recovers("during a flood of half-sent requests", [&] { return farm.get("/").result_int() == 200u; }));
  EXPECT_FALSE(flood.first_is_closed()) << "it was answered before the flood timed out";
}

TEST(Descriptors, APortThatRanOutOfFilesAcceptsAgain) {
  WebFarm farm({}, with_few_files());
  const auto open = [&] { return channel_to(farm.farm().address()); };
  boost::asio::ip::tcp::socket page(farm.io());
  {
    const NoDescriptors none(farm.farm().server().pid());
    EXPECT_FALSE(answers(open()));
    page = farm.connect();  // waits in the kernel's queue
  }
  EXPECT_TRUE(answers_again("after the process had no files left", open));
  EXPECT_EQ(farm.get("/").result_int(), 200u);
}

TEST(Descriptors, AFloodOfTheHealthPortBlocksNoProbe) {
  TemporaryFolder folder;
  const std::string port_file = (folder.path() / "port").string();
  const Farm farm({"--health", "127.0.0.1:0", "--health-port-file", port_file}, with_few_files());
  const std::string address = health_address(port_file);
  const Flood flood(port_of(address), "127.0.0.2", kFlood);
  EXPECT_TRUE(eventually([&] { return health(address, "live") == "SERVING"; }));
}

}  // namespace
}  // namespace lightmill::test

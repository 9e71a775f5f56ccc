// A farm with all threads at work, for ThreadSanitizer (the preset `tsan`). There are two renders that share data
// between tiles, watchers, requests and connections of the page, changes, and a clean end.
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "common/base/file.h"
#include "lightmill/v1/web.pb.h"
#include "tests/support/farm.h"

namespace lightmill::test {
namespace {

/// A connection to the page's port on this machine.
class Connection {
 public:
  explicit Connection(std::uint16_t port) : handle_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(handle_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    const timeval timeout{kTimeout.count(), 0};
    ::setsockopt(handle_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
  }
  ~Connection() { ::close(handle_); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void send(const std::string& bytes) const {
    EXPECT_EQ(::send(handle_, bytes.data(), bytes.size(), MSG_NOSIGNAL), static_cast<ssize_t>(bytes.size()));
  }
  /// Reads the next bytes, at most this many. Empty at the end.
  std::string receive(std::size_t most = 1 << 16) const {
    std::string bytes(most, '\0');
    const ssize_t got = ::recv(handle_, bytes.data(), bytes.size(), 0);
    bytes.resize(got > 0 ? static_cast<std::size_t>(got) : 0);
    return bytes;
  }
  /// Reads exactly this many bytes, or fewer at the end.
  std::string receive_all(std::size_t count) const {
    std::string bytes;
    for (std::string part = "-"; bytes.size() < count && !part.empty(); bytes += part) {
      part = receive(count - bytes.size());
    }
    return bytes;
  }

 private:
  int handle_;
};

std::string request_text(std::uint16_t port, const std::string& target, const std::string& more) {
  return fmt::format("GET {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n{}\r\n", target, port, more);
}

std::string get(std::uint16_t port, const std::string& target) {
  const Connection connection(port);
  connection.send(request_text(port, target, "Connection: close\r\n"));
  std::string answer;
  for (std::string part = connection.receive(); !part.empty(); part = connection.receive()) {
    answer += part;
  }
  return answer;
}

/// The next message on the page's connection, which is never fragmented. Empty at the end.
std::string receive_message(const Connection& connection) {
  const std::string head = connection.receive_all(2);
  if (head.size() < 2) {
    return "";
  }
  std::uint64_t length = static_cast<unsigned char>(head[1]);
  if (const std::size_t more = length == 127 ? 8 : length == 126 ? 2 : 0; more > 0) {
    length = 0;
    for (const char byte : connection.receive_all(more)) {
      length = length << 8 | static_cast<unsigned char>(byte);
    }
  }
  return connection.receive_all(length);
}

/// A page that views the job and reads until `stop`. Returns the number of messages.
std::uint64_t look_at(std::uint16_t port, std::uint64_t job, const std::atomic<bool>& stop) {
  const Connection page(port);
  page.send(request_text(port, "/api/v1/live",
                         "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                         "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"));
  std::string answer;
  while (!answer.ends_with("\r\n\r\n")) {
    const std::string byte = page.receive(1);
    EXPECT_NE(byte, "") << answer;
    if (byte.empty()) {
      return 0;
    }
    answer += byte;
  }
  EXPECT_NE(answer.find(" 101 "), std::string::npos) << answer;
  std::uint64_t seen = 0;
  while (!stop) {
    v1::ViewRequest request;
    request.set_jobs(true);
    request.set_workers(true);
    request.set_job(job);
    request.set_seen(seen);
    // A client's frame: final and binary, less than 126 bytes, masked by zeros.
    const std::string bytes = request.SerializeAsString();
    page.send(std::string{'\x82', static_cast<char>(0x80 | bytes.size()), 0, 0, 0, 0} + bytes);
    if (receive_message(page).empty()) {
      break;
    }
    ++seen;
  }
  return seen;
}

/// Number of tiles that a watcher receives until the job has ended.
std::size_t watched_tiles(Farm& farm, std::uint64_t job) {
  FarmClient client = farm.client();
  grpc::ClientContext context;
  v1::WatchJobRequest request;
  request.set_id(job);
  request.set_tiles(true);
  const auto reader = client.stub().WatchJob(&context, request);
  std::size_t tiles = 0;
  for (v1::WatchJobResponse response; reader->Read(&response);) {
    tiles += static_cast<std::size_t>(response.tiles_size());
  }
  EXPECT_TRUE(reader->Finish().ok());
  return tiles;
}

void pause_and_resume(Farm& farm, std::uint64_t job) {
  FarmClient client = farm.client();
  v1::Job answer;
  grpc::ClientContext pausing, resuming;
  v1::PauseJobRequest pause;
  pause.set_id(job);
  EXPECT_TRUE(client.stub().PauseJob(&pausing, pause, &answer).ok());
  v1::ResumeJobRequest resume;
  resume.set_id(job);
  EXPECT_TRUE(client.stub().ResumeJob(&resuming, resume, &answer).ok());
}

// A process ends with code 66 if ThreadSanitizer found a fault. Farm checks the logs.
TEST(Threads, WorkInParallelAndEndCleanly) {
  const TemporaryFolder pages;
  const std::string port_file = (pages.path() / "port").string();
  ASSERT_TRUE(write_file_atomically(pages.path() / "index.html", as_byte_view("<p>the page</p>")).ok());
  Farm farm({"--http", "127.0.0.1:0", "--http-port-file", port_file, "--pages", pages.path().string(),
             "--caller-requests", "100000"});
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(port_file); }));
  const auto port = static_cast<std::uint16_t>(std::stoi(read_file(port_file).value()));
  const Picture path{.side = 96, .samples = 16},
      caustic{.side = 96, .samples = 12, .method = "caustic:photons=5000", .scene = "cornell-bench-balls"};
  FarmClient client = farm.client();
  const std::uint64_t first = client.submit(path, "path").id(), second = client.submit(caustic, "caustic").id();
  farm.add_worker(2, "w1");
  farm.add_worker(2, "w2");

  std::atomic<bool> stop = false;
  std::atomic<std::uint64_t> seen = 0, tiles = 0;
  std::vector<std::thread> threads;
  threads.emplace_back([&] { seen = look_at(port, first, stop); });
  threads.emplace_back([&] { tiles = watched_tiles(farm, second); });
  threads.emplace_back([&] {
    for (int round = 0; !stop; ++round) {
      const std::string job = fmt::format("/api/v1/jobs/{}", round % 2 == 0 ? first : second);
      for (const std::string& target : {std::string("/"), std::string("/api/v1/jobs"), std::string("/api/v1/workers"),
                                        job + "/thumbnail.png", job + "/picture.exr"}) {
        EXPECT_NE(get(port, target), "") << target;
      }
    }
  });
  pause_and_resume(farm, second);
  client.wait_until_ended(first);
  client.wait_until_ended(second);
  stop = true;
  client.extend(first, 17);  // one more change, for a waiting watcher
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_GT(seen, 0u);
  EXPECT_GE(tiles, 4u);
  expect_reference_film(farm.client(), second, caustic);
  for (const char* worker : {"w1", "w2"}) {
    farm.worker(worker).send(SIGTERM);
    EXPECT_EQ(farm.worker(worker).wait(), 0) << farm.worker_log(worker);
  }
  farm.server().send(SIGTERM);
  EXPECT_EQ(farm.server().wait(), 0) << farm.server_log();
}

}  // namespace
}  // namespace lightmill::test

// Limits of one caller over real connections. A call above the limit is refused with the limit's name, and other
// callers are not affected.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <csignal>

#include "common/base/address.h"
#include "common/wire/farm_messages.h"
#include "tests/support/farm.h"

namespace lightmill::test {
namespace {

using grpc::StatusCode;

grpc::Status list(v1::RenderService::Stub& stub) {
  grpc::ClientContext context;
  v1::ListJobsResponse response;
  return stub.ListJobs(&context, {}, &response);
}

bool says(const grpc::Status& status, const std::string& part) {
  return status.error_message().find(part) != std::string::npos;
}

TEST(Limits, RequestsPerSecondAreLimited) {
  Farm farm({"--caller-requests", "2"});
  FarmClient client = farm.client();
  int taken = 0;
  grpc::Status refused;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually([&] {
    refused = list(client.stub());
    taken += refused.ok() ? 1 : 0;
    return !refused.ok();
  }));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  EXPECT_GE(taken, 15);
  EXPECT_LE(taken, 21 + 2 * seconds) << "on a machine of any speed";
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(says(refused, "2 requests per second from one caller (--caller-requests): try again in "))
      << refused.error_message();
  EXPECT_TRUE(eventually([&] { return list(client.stub()).ok(); })) << "after its own messages";
}

TEST(Limits, StreamsOfOneCallerAreLimited) {
  Farm farm({"--caller-streams", "2"});
  FarmClient client = farm.client();
  client.upload_assets();
  v1::WatchJobRequest request;
  request.set_id(client.submit({}).id());
  struct Watch {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::WatchJobResponse>> reader;
    v1::WatchJobResponse update;
  };
  const auto watch = [&](Watch& each) {
    each.reader = client.stub().WatchJob(&each.context, request);
    return each.reader->Read(&each.update);
  };
  Watch first, second, third, fourth;
  EXPECT_TRUE(watch(first));
  EXPECT_TRUE(watch(second));
  EXPECT_FALSE(watch(third));
  const grpc::Status refused = third.reader->Finish();
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(says(refused, "2 watched jobs of one caller (--caller-streams)")) << refused.error_message();
  first.context.TryCancel();
  (void)first.reader->Finish();
  EXPECT_TRUE(eventually([&] {
    Watch again;
    const bool taken = watch(again);
    again.context.TryCancel();
    (void)again.reader->Finish();
    return taken;
  })) << "its slot is free after its end";
  second.context.TryCancel();
  (void)second.reader->Finish();
}

/// Calls over one connection, after one that is complete. Each announces a request of this size, and sends all of it but
/// the last byte, as far as the server takes it (RFC 9113).
class UnfinishedRequests {
 public:
  UnfinishedRequests(int port, const std::string& path, std::uint32_t count, std::uint32_t request_bytes)
      : socket_(::socket(AF_INET, SOCK_STREAM, 0)), request_bytes_(request_bytes) {
    sockaddr_in own{.sin_family = AF_INET, .sin_port = 0, .sin_addr = {}, .sin_zero = {}};
    ::inet_pton(AF_INET, "127.0.0.2", &own.sin_addr);  // without authentication, callers are told apart by addresses
    EXPECT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&own), sizeof own), 0);
    sockaddr_in to{
        .sin_family = AF_INET, .sin_port = htons(static_cast<std::uint16_t>(port)), .sin_addr = {}, .sin_zero = {}};
    ::inet_pton(AF_INET, "127.0.0.1", &to.sin_addr);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    send_all("PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + frame(kSettings, 0, 0, ""));
    streams_[1] = {};
    send_all(headers(1, "/lightmill.v1.RenderService/ListJobs") + frame(kData, 1, 1, std::string(5, '\0')));
    while (!streams_.empty() && read_some(kTimeout)) {  // until its answer
    }
    for (std::uint32_t i = 1; i <= count; ++i) {
      send_all(headers(2 * i + 1, path));
      streams_[2 * i + 1] = {};
    }
  }
  ~UnfinishedRequests() { ::close(socket_); }
  UnfinishedRequests(const UnfinishedRequests&) = delete;
  UnfinishedRequests& operator=(const UnfinishedRequests&) = delete;

  /// Sends what the server takes, until it takes nothing more for `quiet`, or has ended the connection.
  void send_for(std::chrono::milliseconds quiet) {
    while (!ended_ && (send_more() || read_some(quiet))) {
      read_some(std::chrono::milliseconds(0));
    }
  }
  std::size_t sent() const { return sent_; }  ///< bytes of requests
  bool ended() const { return ended_; }       ///< by the server

 private:
  enum Type : unsigned char { kData = 0, kHeaders = 1, kReset = 3, kSettings = 4, kPing = 6, kWindowUpdate = 8 };
  struct Stream {
    std::int64_t window = 0;  ///< besides the initial window
    std::size_t sent = 0;
  };

  static std::string headers(std::uint32_t stream, const std::string& path) {
    constexpr unsigned char kEndHeaders = 4;
    return frame(kHeaders, kEndHeaders, stream,
                 "\x83\x86" + field("\x04", path) + field("\x01", "farm") + field("\x0f\x10", "application/grpc") +
                     std::string(1, 0) + field("\x02te", "trailers"));
  }
  static std::string field(const std::string& name, const std::string& value) {
    return name + static_cast<char>(value.size()) + value;
  }
  static std::string number(std::uint32_t value) {
    const std::uint32_t bytes = htonl(value);
    return {reinterpret_cast<const char*>(&bytes), 4};
  }
  static std::uint32_t number_at(const std::string& bytes, std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return ntohl(value);
  }
  static std::string frame(unsigned char type, unsigned char flags, std::uint32_t stream, const std::string& payload) {
    return number(static_cast<std::uint32_t>(payload.size())).substr(1) + static_cast<char>(type) +
           static_cast<char>(flags) + number(stream) + payload;
  }
  bool send_all(const std::string& bytes) {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }
  bool send_more() {
    for (auto& [number_of, stream] : streams_) {
      const std::int64_t room = std::min(initial_window_ + stream.window, window_);
      const auto left = (std::int64_t{request_bytes_} + 4 - static_cast<std::int64_t>(stream.sent));
      const auto bytes = static_cast<std::size_t>(std::clamp<std::int64_t>(std::min(room, left), 0, 16384));
      if (bytes == 0 || (stream.sent == 0 && bytes < 5)) {
        continue;
      }
      std::string payload(bytes, '\0');
      if (stream.sent == 0) {
        payload.replace(1, 4, number(request_bytes_));
      }
      if (!send_all(frame(kData, 0, number_of, payload))) {
        ended_ = true;
        return false;
      }
      stream.sent += bytes;
      stream.window -= static_cast<std::int64_t>(bytes);
      window_ -= static_cast<std::int64_t>(bytes);
      sent_ += bytes;
      return true;
    }
    return false;
  }
  bool read_some(std::chrono::milliseconds quiet) {
    pollfd readable{socket_, POLLIN, 0};
    if (::poll(&readable, 1, static_cast<int>(quiet.count())) != 1) {
      return false;
    }
    std::array<char, 65536> bytes{};
    const ssize_t got = ::recv(socket_, bytes.data(), bytes.size(), 0);
    if (got <= 0) {
      ended_ = true;
      return false;
    }
    received_.append(bytes.data(), static_cast<std::size_t>(got));
    while (received_.size() >= 9) {
      const std::size_t length = number_at(std::string(1, 0) + received_.substr(0, 3), 0);
      if (received_.size() < 9 + length) {
        break;
      }
      take(static_cast<unsigned char>(received_[3]), static_cast<unsigned char>(received_[4]), number_at(received_, 5),
           received_.substr(9, length));
      received_.erase(0, 9 + length);
    }
    return true;
  }
  void take(unsigned char type, unsigned char flags, std::uint32_t stream, const std::string& payload) {
    if (type == kWindowUpdate) {
      const auto more = static_cast<std::int64_t>(number_at(payload, 0));
      if (stream == 0) {
        window_ += more;
      } else if (const auto found = streams_.find(stream); found != streams_.end()) {
        found->second.window += more;
      }
    } else if (type == kPing && (flags & 1) == 0) {
      send_all(frame(kPing, 1, 0, payload));
    } else if (type == kSettings && (flags & 1) == 0) {
      constexpr int kInitialWindow = 4;
      for (std::size_t at = 0; at + 6 <= payload.size(); at += 6) {
        if (payload[at + 1] == kInitialWindow) {
          initial_window_ = number_at(payload, at + 2);
        }
      }
      send_all(frame(kSettings, 1, 0, ""));
    } else if (type == kReset || (type == kHeaders && (flags & 1) != 0)) {
      streams_.erase(stream);
    }
  }

  const int socket_;
  const std::uint32_t request_bytes_;
  bool ended_ = false;
  std::string received_;
  std::map<std::uint32_t, Stream> streams_;
  std::int64_t window_ = 65535, initial_window_ = 65535;
  std::size_t sent_ = 0;
};

struct Attack {
  const char* name;
  const char* path;
  std::uint32_t calls, request_bytes;
  friend void PrintTo(const Attack& attack, std::ostream* out) { *out << attack.name; }
};

class UnfinishedRequestsTest : public ::testing::TestWithParam<Attack> {};

TEST_P(UnfinishedRequestsTest, OneCallerHasBoundedMemory) {
  const auto& [name, path, calls, request_bytes] = GetParam();
  Farm farm({"--wire-gib", "0.25"});
  farm.add_worker(1, "worker");
  ASSERT_TRUE(eventually([&] { return farm.met("worker"); }));
  UnfinishedRequests requests(parse_host_port(farm.address())->port, path, calls, request_bytes);
  requests.send_for(std::chrono::seconds(5));
  EXPECT_TRUE(requests.ended());
  EXPECT_GT(requests.sent(), std::size_t{40} << 20);
  FarmClient client = farm.client();
  const grpc::Status listed = list(client.stub());
  EXPECT_TRUE(listed.ok()) << listed.error_message();
  EXPECT_FALSE(farm.missed("worker"));
}

INSTANTIATE_TEST_SUITE_P(
    Limits, UnfinishedRequestsTest,
    ::testing::Values(Attack{"ManyRequests", "/lightmill.v1.RenderService/ListJobs", 100, 19 << 20},
                      Attack{"OneHugeRequest", "/lightmill.v1.RenderService/ListJobs", 1, 1u << 31},
                      Attack{"HealthChecks", "/grpc.health.v1.Health/Check", 100, 19 << 20},
                      Attack{"Films", "/lightmill.v1.RenderService/GetFilm", 100, 19 << 20}),
    [](const auto& attack) { return attack.param.name; });

TEST(Limits, AWorkerJoinsAFullFarmWhenAnotherLeaves) {
  Farm farm({"--max-workers", "1"});
  farm.add_worker(1, "first");
  ASSERT_TRUE(eventually([&] { return farm.met("first"); }));
  BackgroundProcess& second = farm.add_worker(1, "second");
  const std::string reason = "the farm is full: it takes 1 workers (--max-workers)";
  EXPECT_TRUE(eventually([&] { return farm.worker_log("second").find(reason) != std::string::npos; }));
  farm.worker("first").send(SIGTERM);
  EXPECT_TRUE(eventually([&] { return farm.met("second"); }));
  EXPECT_FALSE(second.wait(std::chrono::milliseconds(0))) << "it stayed, and retried";
}

TEST(Limits, JobsOfOneUserAreLimited) {
  Farm farm({"--user-jobs", "2"});
  FarmClient client = farm.client();
  client.upload_assets();
  const auto submit = [&](const std::string& request_id, const std::string& owner) {
    JobSpec spec = job_of({}, request_id);
    spec.owner = owner;
    v1::SubmitJobRequest request;
    to_wire(spec, &request);
    grpc::ClientContext context;
    v1::Job job;
    return client.stub().SubmitJob(&context, request, &job);
  };
  EXPECT_TRUE(submit("1", "ada").ok());
  EXPECT_TRUE(submit("2", "ada").ok());
  const grpc::Status refused = submit("3", "ada");
  EXPECT_EQ(refused.error_code(), StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(says(refused, "at most 2 jobs of one user, 'ada'")) << refused.error_message();
  EXPECT_TRUE(submit("2", "ada").ok()) << "a repetition creates no job";
  EXPECT_TRUE(submit("4", "bob").ok());
}

}  // namespace
}  // namespace lightmill::test

// Cost of a hostile client to others: a farm's throughput and answer times, with and without a thousand connections.
// The connections stay silent, send half of what they announce, or never read.
//
// The hostile client speaks plain HTTP/2 from its own address (127.0.0.2) and reconnects when it is disconnected. The
// workers are held to a share of a core, so other load on the machine matters little. Turns with and without the client
// alternate.
#include <arpa/inet.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>

#include "common/base/machine_memory.h"
#include "tests/bench/cpu_share.h"
#include "tests/support/farm.h"

namespace {

using namespace lightmill;
using SteadyClock = std::chrono::steady_clock;

struct Options {
  int connections = 1000, turns = 5;
  double seconds = 15, share = 0.2;
};

// ---- HTTP/2, RFC 9113, as far as the client needs it ----

constexpr const char* kPreface = "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";
enum FrameType : char { kData = 0, kHeaders = 1, kSettings = 4, kWindowUpdate = 8 };
constexpr char kEndStream = 1, kEndHeaders = 4;

std::string big_endian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = bytes - 1; i >= 0; --i) {
    text += static_cast<char>(value >> (8 * i));
  }
  return text;
}

std::string frame(FrameType type, char flags, std::uint32_t stream, const std::string& payload) {
  return big_endian(static_cast<std::uint32_t>(payload.size()), 3) + static_cast<char>(type) + flags +
         big_endian(stream, 4) + payload;
}

/// The preface, and the largest windows. A client that never reads has announced that it accepts everything.
std::string hello() {
  return kPreface + frame(kSettings, 0, 0, big_endian(4, 2) + big_endian(0x7fffffff, 4)) +
         frame(kWindowUpdate, 0, 0, big_endian(0x7fff0000, 4));
}

std::string call_headers(std::uint32_t stream, const std::string& method) {
  const std::vector<std::pair<std::string, std::string>> headers{
      {":method", "POST"},    {":scheme", "http"}, {":path", "/lightmill.v1." + method},
      {":authority", "farm"}, {"te", "trailers"},  {"content-type", "application/grpc"}};
  std::string block;  // literals that are not indexed (RFC 7541, 6.2.2), all shorter than 127 bytes
  for (const auto& [name, value] : headers) {
    block += '\0';
    block += static_cast<char>(name.size()) + name;
    block += static_cast<char>(value.size()) + value;
  }
  return frame(kHeaders, kEndHeaders, stream, block);
}

/// A message with an announced size. Only `bytes` of it are sent.
std::string message(std::uint32_t stream, std::uint32_t announced, const std::string& bytes) {
  const bool whole = announced == bytes.size();
  return frame(kData, whole ? kEndStream : '\0', stream, '\0' + big_endian(announced, 4) + bytes);
}

/// The bytes that connection `i` sends before it falls silent. `job`: a request that names a job (field 1).
std::string words_of(int i, const std::string& job) {
  switch (i % 6) {
    case 0:
      return "";
    case 1:
      return std::string(kPreface).substr(0, 12);
    case 2:
      return hello() + call_headers(1, "RenderService/SubmitJob") + message(1, 1 << 20, std::string(500, 'x'));
    case 3:
      return hello() + call_headers(1, "WorkerService/Work") + message(1, 1 << 20, std::string(500, 'x'));
    default:  // 4: watches a job with its tiles (field 2), 5: gets its film; several at once, without reading
      std::string words = hello();
      for (std::uint32_t stream = 1; stream < 16; stream += 2) {
        const bool watches = i % 6 == 4;
        const std::string request = watches ? job + std::string("\x10\x01") : job;
        words += call_headers(stream, watches ? "RenderService/WatchJob" : "RenderService/GetFilm") +
                 message(stream, static_cast<std::uint32_t>(request.size()), request);
      }
      return words;
  }
}

/// Bytes sent to a connection that never reads. The rest waits at the sender.
constexpr int kFullWindow = 2048;

/// The connections. A thread reconnects them.
class HostileClient {
 public:
  HostileClient(int port, int connections, std::string job)
      : port_(port), job_(std::move(job)), sockets_(static_cast<std::size_t>(connections), -1) {
    for (std::size_t i = 0; i < sockets_.size(); ++i) {
      come(i);
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { come_again(stop); });
  }
  ~HostileClient() {
    stop();
    for (const int socket : sockets_) {
      ::close(socket);
    }
  }
  HostileClient(const HostileClient&) = delete;
  HostileClient& operator=(const HostileClient&) = delete;
  int times_closed_by_server() const { return closed_by_server_; }
  /// Stops reconnecting.
  void stop() {
    thread_.request_stop();
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  /// The number of connections with more than this many unread bytes. Call it after stop().
  int answered(int bytes) const {
    return static_cast<int>(std::ranges::count_if(sockets_, [&](int socket) {
      int waiting = 0;
      return ::ioctl(socket, FIONREAD, &waiting) == 0 && waiting > bytes;
    }));
  }

 private:
  void come(std::size_t i) {
    const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    LM_CHECK(socket >= 0, "cannot open connection {}: {}", i, std::strerror(errno));
    const int small = 4096;
    (void)::setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &small, sizeof(small));
    sockaddr_in own{}, server{};
    own.sin_family = server.sin_family = AF_INET;
    LM_CHECK(::inet_pton(AF_INET, "127.0.0.2", &own.sin_addr) == 1);
    LM_CHECK(::inet_pton(AF_INET, "127.0.0.1", &server.sin_addr) == 1);
    server.sin_port = htons(static_cast<std::uint16_t>(port_));
    LM_CHECK(::bind(socket, reinterpret_cast<const sockaddr*>(&own), sizeof(own)) == 0, "cannot bind to 127.0.0.2");
    LM_CHECK(::connect(socket, reinterpret_cast<const sockaddr*>(&server), sizeof(server)) == 0,
             "the coordinator refuses connection {}: {}", i, std::strerror(errno));
    const std::string words = words_of(static_cast<int>(i), job_);
    (void)::send(socket, words.data(), words.size(), MSG_NOSIGNAL);
    sockets_[i] = socket;
  }

  void come_again(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
      std::vector<pollfd> all;
      for (const int socket : sockets_) {
        all.push_back({socket, POLLRDHUP, 0});
      }
      (void)::poll(all.data(), all.size(), 0);
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (all[i].revents != 0) {
          ::close(sockets_[i]);
          ++closed_by_server_;
          come(i);
        }
      }
    }
  }

  const int port_;
  const std::string job_;
  std::vector<int> sockets_;
  std::atomic<int> closed_by_server_ = 0;
  std::jthread thread_;
};

// ---- service to other callers ----

struct Turns {
  std::vector<double> throughput;  ///< samples per second
  std::vector<double> answer_ms;   ///< of GetJob, each call of another caller
  std::vector<double> core;        ///< of the coordinator
};

void measure_turn(test::Farm& farm, std::uint64_t job, double seconds, Turns& turns) {
  test::FarmClient client = farm.client();
  const auto start = SteadyClock::now();
  const auto passed = [&] { return std::chrono::duration<double>(SteadyClock::now() - start).count(); };
  const double cpu = process_cpu_seconds(farm.server().pid());
  const std::uint64_t before = client.job(job).samples_done();
  double until_last_answer = 0;
  std::uint64_t done = before;
  while (passed() < seconds) {
    const double asked = passed();
    done = client.job(job).samples_done();
    until_last_answer = passed();
    turns.answer_ms.push_back(1e3 * (until_last_answer - asked));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  turns.throughput.push_back(static_cast<double>(done - before) / until_last_answer);
  turns.core.push_back((process_cpu_seconds(farm.server().pid()) - cpu) / passed());
}

std::string row(const std::string& name, Turns turns) {
  std::ranges::sort(turns.answer_ms);
  const auto spread = [](const std::vector<double>& values, double unit) {
    return fmt::format("{:.3g} ({:.3g}-{:.3g})", median(values) / unit, *std::ranges::min_element(values) / unit,
                       *std::ranges::max_element(values) / unit);
  };
  return fmt::format("| {} | {} | {:.2g}, {:.2g} | {} |", name, spread(turns.throughput, 1e6), median(turns.answer_ms),
                     turns.answer_ms[turns.answer_ms.size() * 99 / 100], spread(turns.core, 1));
}

int run(const Options& options) {
  raise_file_limit();
  test::Farm farm;
  std::vector<std::unique_ptr<CpuShare>> shares;
  for (const char* name : {"w1", "w2"}) {
    const pid_t pid = farm.add_worker(1, name).pid();
    LM_CHECK(test::eventually([&] { return farm.met(name); }), "worker {} does not connect", name);
    shares.push_back(std::make_unique<CpuShare>(pid, options.share));
  }
  test::Picture picture;
  picture.side = 256;
  picture.samples = 1 << 24;
  const std::uint64_t job = farm.client().submit(picture).id();
  farm.client().wait_for_samples(job, 64 * 256 * 256);  // full units, and a film worth fetching
  const int port = std::stoi(farm.address().substr(farm.address().find(':') + 1));
  const std::string request = "\x08" + std::string(1, static_cast<char>(job));
  Turns alone, with;
  int closed_by_server = 0, heard = 0, filled = 0;
  for (int turn = 0; turn < options.turns; ++turn) {
    measure_turn(farm, job, options.seconds, alone);
    {
      HostileClient hostile(port, options.connections, request);
      measure_turn(farm, job, options.seconds, with);
      closed_by_server += hostile.times_closed_by_server();
      hostile.stop();
      heard = hostile.answered(0);
      filled = hostile.answered(kFullWindow);
    }
    fmt::print("turn {}: {:.3g} million samples per second alone, {:.3g} with the hostile client\n", turn + 1,
               alone.throughput.back() / 1e6, with.throughput.back() / 1e6);
    std::fflush(stdout);
  }
  fmt::print("\n| | million samples per second | answer to another caller, ms: median, 99 % | coordinator, cores |\n");
  fmt::print("| --- | --- | --- | --- |\n{}\n{}\n", row("alone", alone),
             row(fmt::format("with {} hostile connections", options.connections), with));
  fmt::print(
      "\nmedians: {:.3f} of the throughput alone; {} disconnects; at the end {} of the connections had answers, and {} "
      "had unread pictures\n",
      median(with.throughput) / median(alone.throughput), closed_by_server, heard, filled);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Cost of a hostile client to others. Its thousand connections send half requests, or never read.");
  Options options;
  app.add_option("--connections", options.connections)->capture_default_str()->check(CLI::Range(1, 9000));
  app.add_option("--turns", options.turns, "measurements without and with the hostile client")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  app.add_option("--seconds", options.seconds, "length of a measurement")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 600.0));
  app.add_option("--share", options.share, "share of a core for each of the two workers")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1.0));
  CLI11_PARSE(app, argc, argv);
  return run(options);
}

// A job's picture in another program's window: real connections on this machine, with short pauses. Where a test must
// not wait, the viewer's timeout is longer than the test's.
#include "client/cli/tev_viewer.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <atomic>
#include <fstream>
#include <future>
#include <set>
#include <sstream>

#include "common/wire/bytes.h"
#include "tests/support/process.h"
#include "tests/support/step_clock.h"
#include "tests/support/tcp_sockets.h"
#include "tests/support/tev_window.h"

namespace lightmill::cli {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::eventually;
using test::StepClock;
using test::tcp_sockets;
using test::TcpSocket;
using test::TevListener;
using test::TevWindow;

// A picture of 6 MB.
constexpr int kSide = 64, kColumns = 16, kRows = 8, kTiles = kColumns * kRows;
constexpr std::size_t kTileBytes = std::size_t{3} * kSide * kSide * sizeof(float);
/// Together with the kernel's buffer far smaller than the picture.
constexpr int kSmallBuffer = 64 << 10;
const TevPauses kQuick{milliseconds(100), milliseconds(300), seconds(20)};
const TevPauses kUnlimitedPauses{milliseconds(100), milliseconds(300), std::chrono::hours(1)};
/// A wait this long counts as a wait for the whole hour.
constexpr seconds kTimeLimit = test::kTimeout;

/// All tiles of these rows, as the farm sends them for a job cropped at 100,200.
v1::WatchJobResponse rows(int first, int last, float value) {
  v1::WatchJobResponse response;
  v1::PixelRect* crop = response.mutable_job()->mutable_crop();
  crop->set_x(100);
  crop->set_y(200);
  crop->set_width(kColumns * kSide);
  crop->set_height(kRows * kSide);
  response.mutable_job()->set_name("cup");
  const std::string rgb = float_bytes(std::vector<float>(std::size_t{3} * kSide * kSide, value));
  for (int row = first; row <= last; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      v1::PreviewTile* tile = response.add_tiles();
      tile->mutable_rect()->set_x(100 + column * kSide);
      tile->mutable_rect()->set_y(200 + row * kSide);
      tile->mutable_rect()->set_width(kSide);
      tile->mutable_rect()->set_height(kSide);
      tile->set_rgb(rgb);
    }
  }
  return response;
}

/// Whether all pixels of these rows have this value.
bool shows(const TevWindow& window, int first, int last, float value) {
  const auto found = window.images().find("job 7 cup");
  if (found == window.images().end()) {
    return false;
  }
  const TevWindow::Image& image = found->second;
  bool all = image.width == kColumns * kSide && image.height == kRows * kSide;
  for (int y = first * kSide; all && y < (last + 1) * kSide; ++y) {
    for (int x = 0; all && x < image.width; ++x) {
      all = image.at(x, y) == value;
    }
  }
  return all;
}

/// Standard error of this process while the object exists, readable at any time.
class StandardError {
 public:
  StandardError() : file_(::memfd_create("stderr", MFD_CLOEXEC)), before_(::dup(STDERR_FILENO)) {
    ::dup2(file_, STDERR_FILENO);
  }
  ~StandardError() {
    ::dup2(before_, STDERR_FILENO);
    ::close(before_);
    ::close(file_);
  }
  StandardError(const StandardError&) = delete;
  StandardError& operator=(const StandardError&) = delete;

  std::vector<std::string> lines() const {
    std::string all;
    std::array<char, 4096> piece;
    for (ssize_t got = 0; (got = ::pread(file_, piece.data(), piece.size(), static_cast<off_t>(all.size()))) > 0;) {
      all.append(piece.data(), static_cast<std::size_t>(got));
    }
    std::istringstream text(all);
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) {
      lines.push_back(line);
    }
    return lines;
  }

 private:
  const int file_, before_;
};

class TevViewerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { ::setenv("TERM", "dumb", 1); }  // also where the tests are run in a terminal

  void start(std::uint16_t port, const TevPauses& pauses = kQuick, const Clock& clock = system_clock()) {
    viewer_.emplace(HostPort{"127.0.0.1", port}, 7, console_, pauses, clock);
  }
  /// Waits until the console has `count` lines.
  bool said(std::size_t count) const {
    return eventually([&] { return heard_.lines().size() >= count; });
  }
  /// The console's lines, after the viewer's end.
  std::vector<std::string> said() {
    viewer_.reset();
    return heard_.lines();
  }
  /// Ends the viewer on another thread.
  std::future<void> ending() {
    return std::async(std::launch::async, [this] { viewer_.reset(); });
  }

  const StandardError heard_;
  const Console console_{false};
  std::optional<TevViewer> viewer_;
};

bool is_ready(const std::future<void>& what) {
  return what.wait_for(kTimeLimit) == std::future_status::ready;
}

TEST_F(TevViewerTest, ASlowViewerGetsAllTilesWhileTheTopKeepsChanging) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port());
  viewer_->update(rows(0, kRows - 1, 1));
  TevWindow window = listener.accept();
  // Two rows change whenever one may have been sent. A sender that goes row by row never reaches the third.
  float value = 2;
  for (std::size_t all = 0, read = 0; !shows(window, 2, kRows - 1, 1) && all < 4 * kTiles * kTileBytes; value += 1) {
    for (read = 0; read < kColumns * kTileBytes; read += 32768) {
      ASSERT_TRUE(window.read(32768));
    }
    all += read;
    viewer_->update(rows(0, 1, value));
  }
  EXPECT_TRUE(shows(window, 2, kRows - 1, 1));
  viewer_->update(rows(0, kRows - 1, value));
  while (!shows(window, 0, kRows - 1, value)) {
    ASSERT_TRUE(window.read());
  }
}

TEST_F(TevViewerTest, TheLastPictureIsSentWhileTheViewerReads) {
  // More than the kernel holds of a connection. So between two steps of the clock the sender sends something.
  constexpr std::size_t kBytesAStep = std::size_t{1} << 20;
  StepClock clock;
  const Time begun = clock.now();
  const TevListener listener(0, kSmallBuffer);
  start(listener.port(), {milliseconds(100), milliseconds(100), seconds(2)}, clock);
  viewer_->update(rows(0, kRows - 1, 1));
  TevWindow window = listener.accept();
  std::thread slow([&] {
    for (std::size_t steps = 1; window.read(32768);) {
      if (window.bytes_read() >= steps * kBytesAStep) {
        clock.pass(seconds(1));
        ++steps;
      }
    }
  });
  EXPECT_TRUE(viewer_->finish());
  slow.join();
  EXPECT_GE(clock.now() - begun, seconds(5)) << "longer than a viewer may read nothing";
  EXPECT_TRUE(shows(window, 0, kRows - 1, 1));
  EXPECT_FALSE(window.amid_a_packet());
  EXPECT_TRUE(said().empty());
}

TEST_F(TevViewerTest, AViewerThatReadsNothingAtTheEndTimesOut) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port(), {milliseconds(100), milliseconds(100), seconds(2)});
  const TevWindow window = listener.accept();
  const v1::WatchJobResponse picture = rows(0, kRows - 1, 1);
  viewer_->update(picture);  // the viewer reads nothing from here on
  EXPECT_FALSE(viewer_->finish());
  const std::vector<std::string> said = this->said();
  ASSERT_FALSE(said.empty());  // on a busy machine the viewer may time out once before, and connect again
  EXPECT_NE(said.back().find("is incomplete"), std::string::npos) << said.back();
  EXPECT_NE(said.back().find("has accepted no data for 2.0 s"), std::string::npos) << said.back();
}

/// Waits until the connection at this port is full, because its viewer reads nothing. The kernel takes the last bytes
/// after a quarter of a second.
bool is_full(std::uint16_t port) {
  std::uint64_t held = 0;
  int same = 0;
  return eventually([&] {
    std::uint64_t now = 0;
    for (const TcpSocket& socket : tcp_sockets()) {
      now += socket.local_port == port || socket.remote_port == port ? socket.unsent_bytes + socket.unread_bytes : 0;
    }
    same = now == std::exchange(held, now) && now > kSmallBuffer ? same + 1 : 0;
    return same == 50;
  });
}

/// Whether a thread of this process is waiting.
bool waits(pid_t thread) {
  std::ifstream stat(fmt::format("/proc/self/task/{}/stat", thread));
  const std::string text((std::istreambuf_iterator<char>(stat)), {});
  return text.substr(text.rfind(')') + 1).starts_with(" S");
}

TEST_F(TevViewerTest, AnInterruptionStopsTheLastPictureAtOnce) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port(), kUnlimitedPauses);
  viewer_->update(rows(0, kRows - 1, 1));
  TevWindow window = listener.accept();
  EXPECT_TRUE(is_full(listener.port()));
  std::atomic<pid_t> finishing = 0;
  const std::future<void> finished = std::async(std::launch::async, [&] {
    finishing = ::gettid();
    EXPECT_FALSE(viewer_->finish());
  });
  EXPECT_TRUE(eventually([&] { return finishing != 0 && waits(finishing); }));
  viewer_->stop();
  EXPECT_TRUE(is_ready(finished));
  window.close();  // otherwise the test would wait for an hour, too
}

TEST_F(TevViewerTest, DestructionDoesNotWaitForAStalledViewer) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port(), kUnlimitedPauses);
  viewer_->update(rows(0, kRows - 1, 1));
  TevWindow window = listener.accept();
  EXPECT_TRUE(is_full(listener.port()));
  const std::future<void> ended = ending();
  EXPECT_TRUE(is_ready(ended));
  window.close();
}

/// A port that does not answer: its queue is full.
class DeafPort {
 public:
  DeafPort() {
    for (int i = 0; i < 4; ++i) {  // more than listen(1) keeps
      sockaddr_in address{};
      address.sin_family = AF_INET;
      address.sin_port = htons(listener_.port());
      address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      waiting_.emplace_back(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
      ::connect(waiting_.back(), reinterpret_cast<sockaddr*>(&address), sizeof address);
    }
  }
  ~DeafPort() {
    for (const int each : waiting_) {
      ::close(each);
    }
  }
  DeafPort(const DeafPort&) = delete;
  DeafPort& operator=(const DeafPort&) = delete;
  std::uint16_t port() const { return listener_.port(); }
  /// Refuses the connections that wait.
  void refuse_all() const { listener_.stop(); }
  /// Ports of the connections that wait for an answer now.
  std::set<unsigned> knocking() const {
    std::set<unsigned> ports;
    for (const TcpSocket& socket : tcp_sockets()) {
      if (socket.connecting && socket.remote_port == port()) {
        ports.insert(socket.local_port);
      }
    }
    return ports;
  }

 private:
  TevListener listener_;
  std::vector<int> waiting_;
};

TEST_F(TevViewerTest, AnUnansweredConnectionIsReportedOnce) {
  const DeafPort deaf;
  std::set<unsigned> tries = deaf.knocking();
  const std::size_t others = tries.size();
  start(deaf.port(), {milliseconds(100), milliseconds(100), milliseconds(200)});
  EXPECT_TRUE(eventually([&] {
    tries.merge(deaf.knocking());
    return tries.size() >= others + 3;
  }));
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("(no answer for 0.2 s): start tev or HDRView there"), std::string::npos) << said[0];
}

TEST_F(TevViewerTest, DestructionDoesNotWaitForAnAnswer) {
  const DeafPort deaf;
  const std::size_t others = deaf.knocking().size();
  start(deaf.port(), kUnlimitedPauses);
  ASSERT_TRUE(eventually([&] { return deaf.knocking().size() > others; }));
  const std::future<void> ended = ending();
  EXPECT_TRUE(is_ready(ended));
  deaf.refuse_all();
  ended.wait();
  EXPECT_TRUE(said().empty());
}

TEST_F(TevViewerTest, AClosingPortIsRetriedWithPausesAndReportedOnce) {
  const TevListener tunnel;
  constexpr milliseconds kRetry{200};
  start(tunnel.port(), {kRetry, seconds(20), seconds(20)});
  viewer_->update(rows(0, 0, 1));
  // A pause follows each end. A busy machine makes it longer, never shorter.
  const auto begun = std::chrono::steady_clock::now();
  for (int call = 0; call < 3; ++call) {
    tunnel.accept().close();
  }
  EXPECT_GE(std::chrono::steady_clock::now() - begun, 2 * kRetry);
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("start tev or HDRView there. Retrying"), std::string::npos) << said[0];
}

TEST_F(TevViewerTest, AReopenedViewerGetsTheWholePicture) {
  const TevListener listener;
  start(listener.port());
  viewer_->update(rows(0, kRows - 1, 1));
  {
    TevWindow window = listener.accept();
    while (!shows(window, 0, kRows - 1, 1)) {
      ASSERT_TRUE(window.read());
    }
    listener.stop();
  }
  ASSERT_TRUE(said(1));
  listener.listen();
  TevWindow window = listener.accept();
  while (!shows(window, 0, kRows - 1, 1)) {
    ASSERT_TRUE(window.read());
  }
  EXPECT_TRUE(said(2));
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 2u);
  EXPECT_TRUE(said[0].starts_with("no viewer at 127.0.0.1:")) << said[0];
  EXPECT_TRUE(said[1].starts_with("showing the picture in the viewer at 127.0.0.1:")) << said[1];
}

TEST_F(TevViewerTest, AnUnknownHostIsReported) {
  viewer_.emplace(HostPort{"viewer.invalid", 14158}, 7, console_, kQuick);
  EXPECT_FALSE(viewer_->finish());
  const std::vector<std::string> said = this->said();
  ASSERT_FALSE(said.empty());  // it may have tried once before the end
  EXPECT_NE(said.back().find("viewer.invalid:14158"), std::string::npos) << said.back();
}

}  // namespace
}  // namespace lightmill::cli

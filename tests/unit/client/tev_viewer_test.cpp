// A job's picture in another program's window: real connections on this machine, with short pauses.
#include "client/cli/tev_viewer.h"

#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <atomic>

#include "common/wire/bytes.h"
#include "tests/support/process.h"
#include "tests/support/tev_window.h"

namespace lightmill::cli {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::TevListener;
using test::TevWindow;

// A picture of 6 MB.
constexpr int kSide = 64, kColumns = 16, kRows = 8, kTiles = kColumns * kRows;
constexpr std::size_t kTileBytes = std::size_t{3} * kSide * kSide * sizeof(float);
/// With what the kernel keeps for the viewer, far less than the picture.
constexpr int kSmallBuffer = 64 << 10;
const TevPauses kQuick{milliseconds(100), milliseconds(300), seconds(20)};

/// All tiles of these rows, as the farm sends them of a job that was cropped at 100,200.
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

class TevViewerTest : public ::testing::Test {
 protected:
  void SetUp() override {
    ::setenv("TERM", "dumb", 1);  // also where the tests are run in a terminal
    ::testing::internal::CaptureStderr();
    console_.emplace(false);
  }
  void TearDown() override {
    if (!said_) {
      said();
    }
  }
  void start(std::uint16_t port, const TevPauses& pauses = kQuick) {
    viewer_.emplace(HostPort{"127.0.0.1", port}, 7, *console_, pauses);
  }
  /// How long it takes to end.
  Duration end() {
    const auto before = std::chrono::steady_clock::now();
    viewer_.reset();
    return std::chrono::steady_clock::now() - before;
  }
  /// What the console was told, after the viewer's end.
  std::vector<std::string> said() {
    viewer_.reset();
    said_ = true;
    std::istringstream text(::testing::internal::GetCapturedStderr());
    std::vector<std::string> lines;
    for (std::string line; std::getline(text, line);) {
      lines.push_back(line);
    }
    return lines;
  }

  std::optional<Console> console_;
  std::optional<TevViewer> viewer_;
  bool said_ = false;
};

TEST_F(TevViewerTest, ASlowViewerGetsAllOfAPictureWhoseTopChangesFasterThanItIsSent) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port());
  viewer_->update(rows(0, kRows - 1, 1));
  TevWindow window = listener.accept();
  // Two rows change whenever one may have been sent: whoever goes by rows never comes to the third.
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

TEST_F(TevViewerTest, TheLastPictureIsSentForAsLongAsItIsTaken) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port(), {milliseconds(100), milliseconds(100), seconds(2)});
  viewer_->update(rows(0, kRows - 1, 1));
  TevWindow window = listener.accept();
  std::thread slow([&] {  // a hundredth of the picture at a time: it takes three times as long as nothing may be taken
    while (window.read()) {
      std::this_thread::sleep_for(milliseconds(60));
    }
  });
  viewer_->finish();
  slow.join();
  EXPECT_TRUE(shows(window, 0, kRows - 1, 1));
  EXPECT_FALSE(window.amid_a_packet());
  EXPECT_TRUE(said().empty());
}

TEST_F(TevViewerTest, WhoTakesNothingAtTheEndIsGivenUp) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port(), {milliseconds(100), milliseconds(100), milliseconds(300)});
  viewer_->update(rows(0, kRows - 1, 1));
  const TevWindow window = listener.accept();
  viewer_->finish();
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("has taken nothing for 0.3 s"), std::string::npos) << said[0];
}

TEST_F(TevViewerTest, AnInterruptionEndsTheLastPictureAtOnce) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port());
  viewer_->update(rows(0, kRows - 1, 1));
  const TevWindow window = listener.accept();
  std::thread interrupting([&] {
    std::this_thread::sleep_for(milliseconds(100));
    viewer_->stop();
  });
  const auto before = std::chrono::steady_clock::now();
  viewer_->finish();
  EXPECT_LT(std::chrono::steady_clock::now() - before, seconds(10)) << "half its patience";
  interrupting.join();
}

TEST_F(TevViewerTest, ItEndsAtOnceWhileNothingIsTaken) {
  const TevListener listener(0, kSmallBuffer);
  start(listener.port());
  viewer_->update(rows(0, kRows - 1, 1));
  TevWindow window = listener.accept();
  ASSERT_TRUE(window.read());
  EXPECT_LT(end(), seconds(10));
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

 private:
  TevListener listener_;
  std::vector<int> waiting_;
};

TEST_F(TevViewerTest, WhoDoesNotAnswerIsSaidToInPlainWords) {
  const DeafPort deaf;
  start(deaf.port(), {milliseconds(100), milliseconds(100), milliseconds(200)});
  std::this_thread::sleep_for(seconds(1));
  EXPECT_LT(end(), seconds(10));
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("(no answer for 0.2 s): start tev or HDRView there"), std::string::npos) << said[0];
}

TEST_F(TevViewerTest, ItEndsAtOnceWhileItWaitsForAnAnswer) {
  const DeafPort deaf;
  start(deaf.port());
  std::this_thread::sleep_for(milliseconds(200));
  EXPECT_LT(end(), seconds(10));
  EXPECT_TRUE(said().empty());
}

TEST_F(TevViewerTest, APortThatHangsUpIsTriedNowAndThenAndTheConsoleHearsOfItOnce) {
  const TevListener tunnel;
  start(tunnel.port(), {milliseconds(200), seconds(20), seconds(20)});
  viewer_->update(rows(0, 0, 1));
  int calls = 0;
  const auto until = std::chrono::steady_clock::now() + seconds(2);
  while (std::chrono::steady_clock::now() < until) {
    if (tunnel.called(milliseconds(10))) {
      tunnel.accept().close();
      ++calls;
    }
  }
  EXPECT_GE(calls, 2);
  EXPECT_LE(calls, 11) << "one each 200 ms";
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("start tev or HDRView there; it is tried again"), std::string::npos) << said[0];
}

TEST_F(TevViewerTest, AViewerThatIsClosedAndComesBackWhileNothingChangesGetsAllOfThePicture) {
  std::optional<TevListener> listener(std::in_place);
  const std::uint16_t port = listener->port();
  start(port);
  viewer_->update(rows(0, kRows - 1, 1));
  {
    TevWindow window = listener->accept();
    while (!shows(window, 0, kRows - 1, 1)) {
      ASSERT_TRUE(window.read());
    }
    listener.reset();
  }
  std::this_thread::sleep_for(milliseconds(300));
  listener.emplace(port);
  TevWindow window = listener->accept();
  while (!shows(window, 0, kRows - 1, 1)) {
    ASSERT_TRUE(window.read());
  }
  std::this_thread::sleep_for(2 * kQuick.lasting);
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 2u);
  EXPECT_TRUE(said[0].starts_with("no viewer at 127.0.0.1:")) << said[0];
  EXPECT_TRUE(said[1].starts_with("the picture goes to the viewer at 127.0.0.1:")) << said[1];
}

TEST_F(TevViewerTest, AnUnknownNameIsSaidToBeOne) {
  viewer_.emplace(HostPort{"viewer.invalid", 14158}, 7, *console_, kQuick);
  viewer_->finish();
  const std::vector<std::string> said = this->said();
  ASSERT_EQ(said.size(), 1u);
  EXPECT_NE(said[0].find("viewer.invalid:14158"), std::string::npos) << said[0];
}

}  // namespace
}  // namespace lightmill::cli

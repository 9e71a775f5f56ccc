// Output that follows a job: lines without a terminal, and the rewritten picture.
#include <gtest/gtest.h>

#include <sstream>
#include <thread>

#include "client/cli/live_picture.h"
#include "client/cli/progress.h"
#include "common/image/picture_file.h"
#include "common/wire/bytes.h"
#include "tests/support/step_clock.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::cli {
namespace {

v1::Job job_at(std::uint64_t done) {
  v1::Job job;
  job.set_state(v1::JOB_STATE_RUNNING);
  job.mutable_goal()->set_samples(100);
  job.set_samples_done(done);
  job.set_samples_wanted(100);
  return job;
}

/// The number of lines that `show` prints for one message.
std::size_t lines_of(ProgressPrinter& printer, const v1::Job& job) {
  ::testing::internal::CaptureStderr();
  printer.show(job);
  const std::string text = ::testing::internal::GetCapturedStderr();
  return static_cast<std::size_t>(std::ranges::count(text, '\n'));
}

TEST(PlainProgress, IsThrottled) {
  ::setenv("TERM", "dumb", 1);  // even if the tests run in a terminal
  const Console plain(false);
  test::StepClock clock;
  ProgressPrinter printer(plain, clock);
  EXPECT_EQ(lines_of(printer, job_at(0)), 1u);   // the first
  EXPECT_EQ(lines_of(printer, job_at(50)), 0u);  // too soon
  clock.pass(std::chrono::seconds(1));
  EXPECT_EQ(lines_of(printer, job_at(5)), 0u);  // too little
  EXPECT_EQ(lines_of(printer, job_at(50)), 1u);
  clock.pass(std::chrono::seconds(10));
  EXPECT_EQ(lines_of(printer, job_at(50)), 1u);  // a sign of life
  v1::Job done = job_at(100);
  done.set_state(v1::JOB_STATE_DONE);
  EXPECT_EQ(lines_of(printer, done), 1u);  // a change of state, at once
}

TEST(Console, KeepsTheLinesOfTwoThreadsApart) {
  const Console console(false);
  ::testing::internal::CaptureStderr();
  std::thread news([&] {
    for (int i = 0; i < 1000; ++i) {
      console.notice("news");
    }
  });
  for (int i = 0; i < 1000; ++i) {
    console.redraw("10%");
  }
  news.join();
  console.end_redraw();
  std::istringstream text(::testing::internal::GetCapturedStderr());
  int notices = 0;
  for (std::string line; std::getline(text, line);) {
    // The terminal's view: a notice deletes the redrawn line, and the next redraw is below it.
    const std::string shown = line.substr(line.rfind('\r') == std::string::npos ? 0 : line.rfind('\r'));
    const bool is_news = shown == "news" || shown == "\r\x1b[Knews";
    notices += is_news ? 1 : 0;
    EXPECT_TRUE(is_news || line.find("news") == std::string::npos) << line;
  }
  EXPECT_EQ(notices, 1000);
}

TEST(Console, RestoresTheRedrawnLineAtItsEnd) {
  const Console console(false);
  ::testing::internal::CaptureStderr();
  console.redraw("10%");
  std::fputs("^C", stderr);  // the terminal's echo
  (void)console.fail(invalid_argument("interrupted"));
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "\r10%\x1b[K^C\r10%\x1b[K\nlightmill: interrupted\n");
}

v1::WatchJobResponse message(int x, int y, int width, int height, float value) {
  v1::WatchJobResponse response;
  v1::PixelRect* crop = response.mutable_job()->mutable_crop();
  crop->set_x(10);
  crop->set_y(20);
  crop->set_width(4);
  crop->set_height(2);
  v1::PreviewTile* tile = response.add_tiles();
  tile->mutable_rect()->set_x(x);
  tile->mutable_rect()->set_y(y);
  tile->mutable_rect()->set_width(width);
  tile->mutable_rect()->set_height(height);
  tile->set_rgb(float_bytes(std::vector<float>(static_cast<std::size_t>(3 * width * height), value)));
  return response;
}

TEST(LivePicture, ShowsTilesInTheirPlacesAndIsWrittenAtMostOnceASecond) {
  const test::TemporaryFolder folder;
  const std::string path = (folder.path() / "live.png").string();
  test::StepClock clock;
  LivePicture live({path}, {}, clock);
  ASSERT_TRUE(live.update(message(12, 20, 2, 1, 1.0f)).ok());
  const std::vector<float> first{0, 0, 1, 1, 0, 0, 0, 0};
  const auto red = [&] {
    const Result<RgbImage> image = load_rgb(path);
    EXPECT_TRUE(image.ok()) << image.status();
    return std::vector<float>(image->values.begin(), image->values.begin() + 8);
  };
  EXPECT_EQ(red(), first);
  ASSERT_TRUE(live.update(message(10, 21, 4, 1, 1.0f)).ok());
  EXPECT_EQ(red(), first);  // within the same second
  clock.pass(std::chrono::seconds(1));
  ASSERT_TRUE(live.update(message(10, 20, 1, 1, 1.0f)).ok());
  EXPECT_EQ(red(), (std::vector<float>{1, 0, 1, 1, 1, 1, 1, 1}));
}

TEST(LivePicture, TilesOutsideThePictureAreRefused) {
  const test::TemporaryFolder folder;
  test::StepClock clock;
  for (const auto& [x, y, width, height] : {std::array{9, 20, 1, 1},
                                            {10, 19, 1, 1},
                                            {13, 20, 2, 1},
                                            {10, 20, 1, 3},
                                            {10, 20, 0, 1},
                                            {2147483647, 20, 1, 1}}) {
    LivePicture live({(folder.path() / "live.png").string()}, {}, clock);
    EXPECT_EQ(live.update(message(x, y, width, height, 1.0f)).code(), StatusCode::kDataLoss) << x << "," << y;
  }
  LivePicture live({(folder.path() / "live.png").string()}, {}, clock);
  v1::WatchJobResponse short_of_pixels = message(10, 20, 2, 2, 1.0f);
  short_of_pixels.mutable_tiles(0)->mutable_rgb()->resize(4);
  EXPECT_EQ(live.update(short_of_pixels).code(), StatusCode::kDataLoss);
}

}  // namespace
}  // namespace lightmill::cli

#include "common/base/log.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(LogTrace, AnInnerTraceReplacesTheOuterOneWhileItLives) {
  const auto logger = spdlog::default_logger();
  ASSERT_TRUE(start_logging("log_test", "info", "text").ok());
  testing::internal::CaptureStderr();
  {
    const LogTrace outer({0, 1});
    {
      const LogTrace inner({0, 2}, 3);
      spdlog::info("in");
    }
    spdlog::info("after");
  }
  spdlog::info("outside");
  const std::string lines = testing::internal::GetCapturedStderr();
  spdlog::set_default_logger(logger);
  const auto fields = [&](const std::string& message) {
    const std::size_t from = lines.find(": " + message) + 2 + message.size();
    return lines.substr(from, lines.find('\n', from) - from);
  };
  EXPECT_EQ(fields("in"), fmt::format(" trace_id={:032x} span_id={:016x}", 2, 3));
  EXPECT_EQ(fields("after"), fmt::format(" trace_id={:032x}", 1));
  EXPECT_EQ(fields("outside"), "");
}

}  // namespace
}  // namespace lightmill

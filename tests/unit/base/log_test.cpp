#include "common/base/log.h"

#include <gtest/gtest.h>
#include <pty.h>
#include <unistd.h>

#include <cstdlib>
#include <regex>

namespace lightmill {
namespace {

/// The line that a logger writes to a terminal as standard error.
std::string line_in_a_terminal(const std::string& program) {
  int terminal = -1, side = -1;
  EXPECT_EQ(::openpty(&terminal, &side, nullptr, nullptr, nullptr), 0);
  const auto logger = spdlog::default_logger();
  const int before = ::dup(STDERR_FILENO);
  ::dup2(side, STDERR_FILENO);
  EXPECT_TRUE(start_logging(program, "info", "text").ok());
  spdlog::info("hello");
  ::dup2(before, STDERR_FILENO);
  spdlog::set_default_logger(logger);
  std::string line;  // the kernel passes it on in parts
  for (char byte = 0; byte != '\n' && ::read(terminal, &byte, 1) == 1;) {
    line += byte;
  }
  for (const int each : {terminal, side, before}) {
    ::close(each);
  }
  return line;
}

TEST(Log, LevelsHaveColoursInATerminalUnlessNoColorIsSet) {
  const char* const term = std::getenv("TERM");
  const std::string before = term == nullptr ? "" : term;
  ::setenv("TERM", "xterm", 1);
  ::unsetenv("NO_COLOR");
  EXPECT_NE(line_in_a_terminal("coloured").find('\x1b'), std::string::npos);
  ::setenv("NO_COLOR", "1", 1);
  EXPECT_EQ(line_in_a_terminal("plain").find('\x1b'), std::string::npos);
  ::unsetenv("NO_COLOR");
  ::setenv("TERM", before.c_str(), 1);
}

TEST(Log, LinesStateThatTheirTimeIsUtc) {
  const auto logger = spdlog::default_logger();
  ASSERT_TRUE(start_logging("utc", "info", "text").ok());
  testing::internal::CaptureStderr();
  spdlog::info("hello");
  const std::string line = testing::internal::GetCapturedStderr();
  spdlog::set_default_logger(logger);
  EXPECT_TRUE(std::regex_match(line, std::regex("[0-9]{4}-[0-9]{2}-[0-9]{2} [0-9:]{8}\\.[0-9]{3}Z info  utc: hello\n")))
      << line;
}

TEST(Log, ErrorsNameTheOptionAndTheKnownWords) {
  EXPECT_EQ(
      message_of(start_logging("bad", "wran", "text")),
      "--log-level: unknown level 'wran'. Did you mean 'warn'? Known levels: trace, debug, info, warn, error, off");
  EXPECT_EQ(message_of(start_logging("bad", "info", "xml")),
            "--log-format: unknown format 'xml'. Known formats: text, json");
}

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

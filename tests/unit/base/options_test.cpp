#include <gtest/gtest.h>

#include "common/base/address.h"
#include "common/base/text.h"
#include "common/command_line/daemon_options.h"

namespace lightmill::test {
namespace {

TEST(HostPort, ReadsNamesAndBothKindsOfAddresses) {
  for (const auto& [text, host, port] : {std::tuple{"farm.example:7350", "farm.example", 7350},
                                         {"127.0.0.1:0", "127.0.0.1", 0},
                                         {"[::1]:65535", "::1", 65535}}) {
    const Result<HostPort> address = parse_host_port(text);
    ASSERT_TRUE(address.ok()) << text;
    EXPECT_EQ(address->host, host);
    EXPECT_EQ(address->port, port);
  }
}

TEST(HostPort, RefusesOtherTexts) {
  for (const char* text : {"", "farm", ":7350", "farm:", "farm:65536", "farm:99999", "farm:-1", "farm:+1", "farm: 1",
                           "farm:7350x", "::1:7350", "[::1]", "[]:1", "[::1:1", "a b:1", "dns:///farm:1"}) {
    EXPECT_EQ(parse_host_port(text).status().code(), StatusCode::kInvalidArgument) << text;
  }
  EXPECT_NE(message_of(parse_host_port("::1:7350").status()).find("[::1]:7350"), std::string::npos);
}

TEST(HostPort, LoopbackDiffersFromSimilarNames) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "::1", "localhost"}) {
    EXPECT_TRUE(is_loopback(host)) << host;
  }
  for (const char* host :
       {"0.0.0.0", "::", "10.0.0.1", "127.evil.example", "localhost.evil.example", "128.0.0.1", "::2"}) {
    EXPECT_FALSE(is_loopback(host)) << host;
  }
}

TEST(EmptyValues, AreRefusedForAllArgumentsBeforeOtherChecks) {
  const auto problem_of = [](std::vector<std::string> words) {
    CLI::App app;
    std::string store, file;
    double limit = 3;
    bool flag = false;
    std::vector<std::string> names;
    app.add_option("--store", store)->envname("LIGHTMILL_TEST_STORE");
    add_limit(app, "--limit", limit, "N", {1.0, 10.0}, "");
    app.add_flag("--flag", flag);
    CLI::App* const command = app.add_subcommand("do", "");
    command->add_option("FILE", file);
    command->add_option("--name", names);
    refuse_empty_values(app);
    std::ranges::reverse(words);  // as CLI11 expects them
    try {
      app.parse(words);
    } catch (const CLI::ParseError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const std::string why = ": a value is expected, got an empty one";
  EXPECT_EQ(problem_of({"--store", ""}), fmt::format("--store{}", why));
  EXPECT_EQ(problem_of({"--limit", ""}), fmt::format("--limit{}", why));
  EXPECT_EQ(problem_of({"do", ""}), fmt::format("FILE{}", why));
  EXPECT_EQ(problem_of({"do", "a", "--name", "b", ""}), fmt::format("--name{}", why));
  EXPECT_EQ(problem_of({"--flag", "--store", "x", "do", "a", "--name", "b"}), "");
  ::setenv("LIGHTMILL_TEST_STORE", "", 1);
  EXPECT_EQ(problem_of({"--flag"}), "") << "as not given";
  ::unsetenv("LIGHTMILL_TEST_STORE");
}

TEST(LibraryText, IsOneShortLine) {
  EXPECT_EQ(library_text("could not connect:\n\trefused\n  Is it up? \r\n\n"),
            "could not connect:; refused; Is it up?");
  EXPECT_EQ(library_text(" \n"), "");
  EXPECT_EQ(library_text("Unexpected end of file.\n"), "Unexpected end of file");
  EXPECT_EQ(library_text("a\x1b[31mb\xff"), "a\\x1b[31mb\\xff");
  const std::string cut = library_text(std::string(100'000, 'x'));
  EXPECT_TRUE(cut.size() < 500 && cut.ends_with("x…")) << cut.size();
}

TEST(Limits, TakeOnlyNumbersInTheirRange) {
  const auto takes = [](const std::string& given) {
    CLI::App app;
    double value = 3;
    add_limit(app, "--limit", value, "N", {1.0, 10.0}, "");
    try {
      app.parse("--limit=" + given);
    } catch (const CLI::ParseError&) {
      return false;
    }
    return value >= 1 && value <= 10;
  };
  for (const char* given : {"1", "10", "2.5"}) {
    EXPECT_TRUE(takes(given)) << given;
  }
  for (const char* given : {"nan", "-nan", "inf", "-inf", "0.5", "10.5", "2x", ""}) {
    EXPECT_FALSE(takes(given)) << given;
  }
}

}  // namespace
}  // namespace lightmill::test

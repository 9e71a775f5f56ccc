#include <gtest/gtest.h>

#include "common/base/address.h"
#include "common/base/daemon_options.h"

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

TEST(HostPort, RefusesAllElse) {
  for (const char* text : {"", "farm", ":7350", "farm:", "farm:65536", "farm:99999", "farm:-1", "farm:+1", "farm: 1",
                           "farm:7350x", "::1:7350", "[::1]", "[]:1", "[::1:1", "a b:1", "dns:///farm:1"}) {
    EXPECT_EQ(parse_host_port(text).status().code(), StatusCode::kInvalidArgument) << text;
  }
  EXPECT_NE(message_of(parse_host_port("::1:7350").status()).find("[::1]:7350"), std::string::npos);
}

TEST(HostPort, LoopbackIsToldFromNamesThatLookLikeIt) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "::1", "localhost"}) {
    EXPECT_TRUE(is_loopback(host)) << host;
  }
  for (const char* host :
       {"0.0.0.0", "::", "10.0.0.1", "127.evil.example", "localhost.evil.example", "128.0.0.1", "::2"}) {
    EXPECT_FALSE(is_loopback(host)) << host;
  }
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

#include "server/access/login_sessions.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

constexpr std::int64_t kLoginNow = 1'800'000'000;

Identity logged_in_ada(const std::string& token = "0123456789ab", std::int64_t until_unix_s = 0) {
  return {"ada", {Role::submit}, Proof::token, until_unix_s, token};
}

TEST(LoginSessions, ASecretIdentifiesItsOwnerUntilItExpiresOrIsRemoved) {
  LoginSessions sessions;
  EXPECT_EQ(sessions.identify("one", kLoginNow).status().code(), StatusCode::kUnauthenticated);
  ASSERT_EQ(sessions.add("one", logged_in_ada(), kLoginNow).value(), kLoginNow + LoginSessions::kLoginSeconds);
  EXPECT_EQ(sessions.identify("one", kLoginNow)->name, "ada");
  EXPECT_FALSE(sessions.identify("two", kLoginNow).ok());
  EXPECT_TRUE(sessions.identify("one", kLoginNow + LoginSessions::kLoginSeconds - 1).ok());
  EXPECT_FALSE(sessions.identify("one", kLoginNow + LoginSessions::kLoginSeconds).ok());
  sessions.remove("one");
  EXPECT_FALSE(sessions.identify("one", kLoginNow).ok());
}

TEST(LoginSessions, NoSessionOutlivesItsToken) {
  LoginSessions sessions;
  EXPECT_EQ(sessions.add("one", logged_in_ada("0123456789ab", kLoginNow + 10), kLoginNow).value(), kLoginNow + 10);
  EXPECT_FALSE(sessions.identify("one", kLoginNow + 10).ok());
}

TEST(LoginSessions, TheOldestSessionOfATokenMakesRoom) {
  LoginSessions sessions;
  ASSERT_TRUE(sessions.add("other", logged_in_ada("ffffffffffff"), kLoginNow).ok());
  for (std::size_t i = 0; i <= LoginSessions::kMaxOfOne; ++i) {
    ASSERT_TRUE(sessions.add(std::to_string(i), logged_in_ada(), kLoginNow).ok());
  }
  EXPECT_EQ(sessions.size(), LoginSessions::kMaxOfOne + 1);
  EXPECT_FALSE(sessions.identify("0", kLoginNow).ok());
  EXPECT_TRUE(sessions.identify("1", kLoginNow).ok());
  EXPECT_TRUE(sessions.identify("other", kLoginNow).ok());
}

TEST(LoginSessions, TheLimitHoldsUntilSessionsExpire) {
  LoginSessions sessions;
  for (std::size_t i = 0; i < LoginSessions::kMaxLogins; ++i) {
    ASSERT_TRUE(
        sessions.add(std::to_string(i), logged_in_ada(fmt::format("{:012x}", i / LoginSessions::kMaxOfOne)), kLoginNow)
            .ok());
  }
  EXPECT_EQ(sessions.add("more", logged_in_ada("ffffffffffff"), kLoginNow).status().code(),
            StatusCode::kResourceExhausted);
  EXPECT_TRUE(sessions.add("more", logged_in_ada("ffffffffffff"), kLoginNow + LoginSessions::kLoginSeconds).ok());
  EXPECT_EQ(sessions.size(), 1u);
}

TEST(LoginSessions, SessionsOfInvalidTokensAreDropped) {
  LoginSessions sessions;
  for (std::size_t i = 0; i < LoginSessions::kMaxLogins; ++i) {
    ASSERT_TRUE(
        sessions.add(std::to_string(i), logged_in_ada(fmt::format("{:012x}", i / LoginSessions::kMaxOfOne)), kLoginNow)
            .ok());
  }
  sessions.keep([](const Identity& caller) { return caller.token != "000000000003"; });
  EXPECT_EQ(sessions.size(), LoginSessions::kMaxLogins - LoginSessions::kMaxOfOne);
  EXPECT_FALSE(sessions.identify("300", kLoginNow).ok());
  EXPECT_TRUE(sessions.identify("299", kLoginNow).ok());
  EXPECT_TRUE(sessions.add("more", logged_in_ada("ffffffffffff"), kLoginNow).ok());
}

}  // namespace
}  // namespace lightmill

#include "server/access/login_book.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

constexpr std::int64_t kLoginNow = 1'800'000'000;

Identity logged_in_ada(const std::string& token = "0123456789ab", std::int64_t until_unix_s = 0) {
  return {"ada", {Role::submit}, Proof::token, until_unix_s, token};
}

TEST(LoginBook, ASecretIdentifiesItsOwnerUntilItExpiresOrIsRemoved) {
  LoginBook book;
  EXPECT_EQ(book.identify("one", kLoginNow).status().code(), StatusCode::kUnauthenticated);
  ASSERT_EQ(book.add("one", logged_in_ada(), kLoginNow).value(), kLoginNow + LoginBook::kLoginSeconds);
  EXPECT_EQ(book.identify("one", kLoginNow)->name, "ada");
  EXPECT_FALSE(book.identify("two", kLoginNow).ok());
  EXPECT_TRUE(book.identify("one", kLoginNow + LoginBook::kLoginSeconds - 1).ok());
  EXPECT_FALSE(book.identify("one", kLoginNow + LoginBook::kLoginSeconds).ok());
  book.remove("one");
  EXPECT_FALSE(book.identify("one", kLoginNow).ok());
}

TEST(LoginBook, NoSessionOutlivesItsToken) {
  LoginBook book;
  EXPECT_EQ(book.add("one", logged_in_ada("0123456789ab", kLoginNow + 10), kLoginNow).value(), kLoginNow + 10);
  EXPECT_FALSE(book.identify("one", kLoginNow + 10).ok());
}

TEST(LoginBook, TheOldestSessionOfATokenMakesRoom) {
  LoginBook book;
  ASSERT_TRUE(book.add("other", logged_in_ada("ffffffffffff"), kLoginNow).ok());
  for (std::size_t i = 0; i <= LoginBook::kMostOfOne; ++i) {
    ASSERT_TRUE(book.add(std::to_string(i), logged_in_ada(), kLoginNow).ok());
  }
  EXPECT_EQ(book.size(), LoginBook::kMostOfOne + 1);
  EXPECT_FALSE(book.identify("0", kLoginNow).ok());
  EXPECT_TRUE(book.identify("1", kLoginNow).ok());
  EXPECT_TRUE(book.identify("other", kLoginNow).ok());
}

TEST(LoginBook, TheLimitHoldsUntilSessionsExpire) {
  LoginBook book;
  for (std::size_t i = 0; i < LoginBook::kMostLogins; ++i) {
    ASSERT_TRUE(
        book.add(std::to_string(i), logged_in_ada(fmt::format("{:012x}", i / LoginBook::kMostOfOne)), kLoginNow).ok());
  }
  EXPECT_EQ(book.add("more", logged_in_ada("ffffffffffff"), kLoginNow).status().code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(book.add("more", logged_in_ada("ffffffffffff"), kLoginNow + LoginBook::kLoginSeconds).ok());
  EXPECT_EQ(book.size(), 1u);
}

TEST(LoginBook, SessionsOfInvalidTokensAreDropped) {
  LoginBook book;
  for (std::size_t i = 0; i < LoginBook::kMostLogins; ++i) {
    ASSERT_TRUE(
        book.add(std::to_string(i), logged_in_ada(fmt::format("{:012x}", i / LoginBook::kMostOfOne)), kLoginNow).ok());
  }
  book.keep([](const Identity& caller) { return caller.token != "000000000003"; });
  EXPECT_EQ(book.size(), LoginBook::kMostLogins - LoginBook::kMostOfOne);
  EXPECT_FALSE(book.identify("300", kLoginNow).ok());
  EXPECT_TRUE(book.identify("299", kLoginNow).ok());
  EXPECT_TRUE(book.add("more", logged_in_ada("ffffffffffff"), kLoginNow).ok());
}

}  // namespace
}  // namespace lightmill

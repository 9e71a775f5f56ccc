#include "server/access/login_book.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

constexpr std::int64_t kNow = 1'800'000'000;

Identity ada(const std::string& token = "0123456789ab", std::int64_t until_unix_s = 0) {
  return {"ada", {Role::submit}, Proof::token, until_unix_s, token};
}

TEST(LoginBook, ASecretStandsForWhoShowedTheTokenUntilItEndsOrIsTakenBack) {
  LoginBook book;
  EXPECT_EQ(book.identify("one", kNow).status().code(), StatusCode::kUnauthenticated);
  ASSERT_EQ(book.add("one", ada(), kNow).value(), kNow + LoginBook::kLoginSeconds);
  EXPECT_EQ(book.identify("one", kNow)->name, "ada");
  EXPECT_FALSE(book.identify("two", kNow).ok());
  EXPECT_TRUE(book.identify("one", kNow + LoginBook::kLoginSeconds - 1).ok());
  EXPECT_FALSE(book.identify("one", kNow + LoginBook::kLoginSeconds).ok());
  book.remove("one");
  EXPECT_FALSE(book.identify("one", kNow).ok());
}

TEST(LoginBook, NoLoginOutlivesItsToken) {
  LoginBook book;
  EXPECT_EQ(book.add("one", ada("0123456789ab", kNow + 10), kNow).value(), kNow + 10);
  EXPECT_FALSE(book.identify("one", kNow + 10).ok());
}

TEST(LoginBook, OfOneTokenTheOldestGoesAndOthersStay) {
  LoginBook book;
  ASSERT_TRUE(book.add("other", ada("ffffffffffff"), kNow).ok());
  for (std::size_t i = 0; i <= LoginBook::kMostOfOne; ++i) {
    ASSERT_TRUE(book.add(std::to_string(i), ada(), kNow).ok());
  }
  EXPECT_EQ(book.size(), LoginBook::kMostOfOne + 1);
  EXPECT_FALSE(book.identify("0", kNow).ok());
  EXPECT_TRUE(book.identify("1", kNow).ok());
  EXPECT_TRUE(book.identify("other", kNow).ok());
}

TEST(LoginBook, ThereIsALimitUntilSomeHaveEnded) {
  LoginBook book;
  for (std::size_t i = 0; i < LoginBook::kMostLogins; ++i) {
    ASSERT_TRUE(book.add(std::to_string(i), ada(fmt::format("{:012x}", i / LoginBook::kMostOfOne)), kNow).ok());
  }
  EXPECT_EQ(book.add("more", ada("ffffffffffff"), kNow).status().code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(book.add("more", ada("ffffffffffff"), kNow + LoginBook::kLoginSeconds).ok());
  EXPECT_EQ(book.size(), 1u);
}

TEST(LoginBook, ThoseOfTokensThatHoldNoLongerTakeNobodysPlace) {
  LoginBook book;
  for (std::size_t i = 0; i < LoginBook::kMostLogins; ++i) {
    ASSERT_TRUE(book.add(std::to_string(i), ada(fmt::format("{:012x}", i / LoginBook::kMostOfOne)), kNow).ok());
  }
  book.keep([](const Identity& caller) { return caller.token != "000000000003"; });
  EXPECT_EQ(book.size(), LoginBook::kMostLogins - LoginBook::kMostOfOne);
  EXPECT_FALSE(book.identify("300", kNow).ok());
  EXPECT_TRUE(book.identify("299", kNow).ok());
  EXPECT_TRUE(book.add("more", ada("ffffffffffff"), kNow).ok());
}

}  // namespace
}  // namespace lightmill

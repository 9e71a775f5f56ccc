// The page's cookie. tests/integration/web_access_test.cpp tests access over a network.
#include "server/web/http_authenticator.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(LoginCookie, IsHiddenFromScriptsAndOtherSites) {
  EXPECT_EQ(set_cookie_header({"localhost:7380", false}, "secret", 60),
            "lightmill-7380=secret; Path=/; Max-Age=60; HttpOnly; SameSite=Strict");
  EXPECT_EQ(set_cookie_header({"farm.example:443", true}, "secret", 60),
            "__Host-lightmill-443=secret; Path=/; Max-Age=60; HttpOnly; SameSite=Strict; Secure");
  EXPECT_EQ(set_cookie_header({"farm.example", true}, "", 60),
            "__Host-lightmill=; Path=/; Max-Age=0; HttpOnly; SameSite=Strict; Secure");
}

TEST(LoginCookie, IsFoundAmongOtherCookiesOfTheHost) {
  EXPECT_EQ(login_cookie("lightmill-7380=one; lightmill-7381=two", {"localhost:7381", false}), "two");
  EXPECT_EQ(login_cookie("a=b;  lightmill=one", {"[::1]", false}), "one");
  EXPECT_EQ(login_cookie("lightmill-80=one; __Host-lightmill-80=two", {"h:80", false}), "two")
      << "which no other page can set";
  EXPECT_EQ(login_cookie("lightmill-443=x", {"h:443", true}), "")
      << "any unencrypted page of the host could have set it";
  EXPECT_EQ(login_cookie("lightmill-443=x; __Host-lightmill-443=y", {"h:443", true}), "y");
  for (const char* header : {"", "lightmill-7380", "xlightmill-7380=one", "lightmill-73801=one", ";;;", "=one"}) {
    EXPECT_EQ(login_cookie(header, {"localhost:7380", false}), "") << header;
  }
}

}  // namespace
}  // namespace lightmill

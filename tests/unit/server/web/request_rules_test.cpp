#include "server/web/request_rules.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(RequestRules, OnlyNamesOfThisMachineAreAnswered) {
  for (const char* host : {"localhost", "localhost:7380", "127.0.0.1:7380", "127.1.2.3", "[::1]:7380", "[::1]"}) {
    EXPECT_TRUE(check_host({host, "", ""}).ok()) << host;
  }
  for (const char* host : {"", "evil.example", "evil.example:7380", "localhost.evil.example", "127.0.0.1.evil.example",
                           "10.0.0.1:7380", "[::2]:7380", "[", "0.0.0.0"}) {
    EXPECT_EQ(check_host({host, "", ""}).code(), StatusCode::kPermissionDenied) << host;
  }
}

TEST(RequestRules, PagesOfOtherOriginsChangeNothing) {
  EXPECT_TRUE(check_origin({"localhost:7380", "http://localhost:7380", "same-origin"}).ok());
  EXPECT_TRUE(check_origin({"localhost:7380", "", ""}).ok()) << "a program that is no browser";
  for (const RequestOrigin& request :
       {RequestOrigin{"localhost:7380", "http://evil.example", ""},
        RequestOrigin{"localhost:7380", "http://localhost:8080", ""},
        RequestOrigin{"localhost:7380", "https://localhost:7380", ""}, RequestOrigin{"localhost:7380", "null", ""},
        RequestOrigin{"localhost:7380", "http://localhost:7380", "cross-site"},
        RequestOrigin{"localhost:7380", "", "same-site"}}) {
    EXPECT_EQ(check_origin(request).code(), StatusCode::kPermissionDenied) << request.origin << request.fetch_site;
  }
}

TEST(RequestRules, BodiesAreJson) {
  EXPECT_TRUE(check_json("application/json").ok());
  EXPECT_TRUE(check_json("application/json; charset=utf-8").ok());
  for (const char* type : {"", "text/plain", "application/x-www-form-urlencoded", "application/jsonp"}) {
    EXPECT_EQ(check_json(type).code(), StatusCode::kInvalidArgument) << type;
  }
}

}  // namespace
}  // namespace lightmill

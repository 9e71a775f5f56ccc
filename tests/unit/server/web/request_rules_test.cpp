#include "server/web/request_rules.h"

#include <gtest/gtest.h>

#include <vector>

namespace lightmill {
namespace {

const std::vector<std::string> kCertified{"farm.example", "*.farms.example", "10.0.0.5"}, kNamed{"Page.example"};
constexpr HostRules kPlain{};

TEST(RequestRules, NamesThatAnotherPageCouldHaveAreRefused) {
  for (const char* host : {"localhost", "localhost:7380", "127.0.0.1:7380", "127.1.2.3", "[::1]:7380", "[::1]",
                           "10.0.0.1:7380", "[2001:db8::2]:7380"}) {
    EXPECT_TRUE(check_host({host, "", ""}, kPlain).ok()) << host;
  }
  for (const char* host : {"", "evil.example", "evil.example:7380", "localhost.evil.example", "127.0.0.1.evil.example",
                           "farm.example", "127.1", "0x7f.1", "[]", "[evil.example]:7380"}) {
    EXPECT_EQ(check_host({host, "", ""}, kPlain).code(), StatusCode::kPermissionDenied) << host;
  }
}

TEST(RequestRules, AHostIsANameOrAnAddressWithAPort) {
  for (const char* host : {"localhost", "farm.example:7380", "127.0.0.1:7380", "127.0.0.1:", "[::1]:7380", "[::1]"}) {
    EXPECT_TRUE(is_host(host)) << host;
  }
  for (const char* host :
       {"", ":7380", "[", "[::1", "[::1]7380", "127.0.0.1:80:90", "127.0.0.1:port", "127.0.0.1/evil", "evil@127.0.0.1",
        "127.0.0.1, evil.example", "127.0.0.1 evil.example", "127.0.0.1#", "::1"}) {
    EXPECT_FALSE(is_host(host)) << host;
  }
}

TEST(RequestRules, CertificateNamesAndConfiguredNamesAreAnswered) {
  const HostRules rules{kCertified, kNamed, true};
  for (const char* host : {"farm.example:7380", "FARM.example", "one.farms.example", "page.example", "10.0.0.5"}) {
    EXPECT_TRUE(check_host({host, "", ""}, rules).ok()) << host;
  }
  for (const char* host : {"farms.example", "a.b.farms.example", "evil.example", "page.example.evil.example"}) {
    EXPECT_EQ(check_host({host, "", ""}, rules).code(), StatusCode::kPermissionDenied) << host;
  }
}

TEST(RequestRules, PagesOfOtherOriginsChangeNothing) {
  EXPECT_TRUE(check_origin({"localhost:7380", "http://localhost:7380", "same-origin"}, kPlain).ok());
  EXPECT_TRUE(check_origin({"localhost:7380", "", ""}, kPlain).ok()) << "a program that is no browser";
  for (const RequestOrigin& request :
       {RequestOrigin{"localhost:7380", "http://evil.example", ""},
        RequestOrigin{"localhost:7380", "http://localhost:8080", ""},
        RequestOrigin{"localhost:7380", "https://localhost:7380", ""}, RequestOrigin{"localhost:7380", "null", ""},
        RequestOrigin{"localhost:7380", "http://localhost:7380", "cross-site"},
        RequestOrigin{"localhost:7380", "", "same-site"}}) {
    EXPECT_EQ(check_origin(request, kPlain).code(), StatusCode::kPermissionDenied)
        << request.origin << request.fetch_site;
  }
}

TEST(RequestRules, AnEncryptedFarmRefusesUnencryptedPages) {
  const HostRules encrypted{kCertified, kNamed, true}, proxied{{}, kNamed, false};
  EXPECT_TRUE(check_origin({"farm.example", "https://farm.example", ""}, encrypted).ok());
  EXPECT_FALSE(check_origin({"farm.example", "http://farm.example", ""}, encrypted).ok());
  EXPECT_FALSE(check_origin({"page.example", "http://page.example", ""}, encrypted).ok());
  EXPECT_TRUE(check_origin({"page.example", "https://page.example", ""}, proxied).ok()) << "a proxy may encrypt";
  EXPECT_FALSE(check_origin({"localhost", "https://localhost", ""}, proxied).ok());
}

TEST(RequestRules, BodiesAreJson) {
  EXPECT_TRUE(check_content_type("application/json", "application/json").ok());
  EXPECT_TRUE(check_content_type("application/json; charset=utf-8", "application/json").ok());
  for (const char* type : {"", "text/plain", "application/x-www-form-urlencoded", "application/jsonp"}) {
    EXPECT_EQ(check_content_type(type, "application/json").code(), StatusCode::kInvalidArgument) << type;
  }
}

}  // namespace
}  // namespace lightmill

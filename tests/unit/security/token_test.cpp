// Tokens: created, found again, and accepted while they are valid.
#include "common/security/token.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <set>

#include "common/base/file.h"
#include "common/security/caller.h"
#include "server/access/token_registry.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

constexpr std::int64_t kTokenNow = 1'800'000'000, kDay = 86'400;

TokenRecord record_of(const NewToken& token, const std::string& name = "ada", Roles roles = {Role::submit}) {
  return {token.id, name, roles, token.hash, "root", kTokenNow, kTokenNow + kDay};
}

TEST(Tokens, HaveAnIdAndTwoHundredFiftySixRandomBits) {
  std::set<std::string> ids, secrets;
  for (int i = 0; i < 100; ++i) {
    const NewToken token = make_token().value();
    EXPECT_EQ(token_id(token.text).value(), token.id);
    EXPECT_EQ(token.hash, sha256(token.text));
    EXPECT_EQ(token.text.size(), std::string("lightmill_").size() + 12 + 1 + 64);
    ids.insert(token.id);
    secrets.insert(token.text.substr(token.text.rfind('_')));
  }
  EXPECT_EQ(ids.size(), 100u);
  EXPECT_EQ(secrets.size(), 100u);
}

TEST(Tokens, OtherTextsAreRefused) {
  const std::string good = make_token()->text;
  for (const std::string& bad :
       {std::string(), std::string("lightmill_"), good + "0", good.substr(1), std::string(good).replace(10, 1, "G"),
        std::string(good).replace(22, 1, "-"), std::string(good).replace(80, 1, "\n")}) {
    EXPECT_EQ(token_id(bad).status().code(), StatusCode::kInvalidArgument) << bad;
    if (bad.size() > 20) {
      EXPECT_EQ(message_of(token_id(bad).status()).find(bad), std::string::npos) << "a secret is not repeated";
    }
  }
}

TEST(TokenRegistry, IdentifiesATokensOwnerUntilItExpires) {
  TokenRegistry registry;
  const NewToken token = make_token().value();
  ASSERT_TRUE(registry.add(record_of(token), kTokenNow).ok());
  const auto identity = registry.identify(token.text, kTokenNow);
  ASSERT_TRUE(identity.ok()) << identity.status();
  EXPECT_EQ(identity->name, "ada");
  EXPECT_EQ(identity->roles, Roles{Role::submit});
  EXPECT_EQ(identity->proof, Proof::token);
  EXPECT_EQ(describe(*identity), "'ada' (roles: submit; by token " + token.id + ")");
  EXPECT_TRUE(registry.check_still_holds(*identity, kTokenNow + kDay - 1).ok());
  EXPECT_EQ(registry.check_still_holds(*identity, kTokenNow + kDay).code(), StatusCode::kUnauthenticated);
  EXPECT_EQ(registry.identify(token.text, kTokenNow + kDay).status().code(), StatusCode::kUnauthenticated);
  ASSERT_TRUE(registry.remove(token.id).ok());
  EXPECT_EQ(registry.check_still_holds(*identity, kTokenNow).code(), StatusCode::kUnauthenticated);
  EXPECT_EQ(registry.identify(token.text, kTokenNow).status().code(), StatusCode::kUnauthenticated);
  EXPECT_EQ(registry.remove(token.id).code(), StatusCode::kNotFound);
}

TEST(TokenRegistry, AWrongSecretAndAWrongIdGiveTheSameError) {
  TokenRegistry registry;
  const NewToken token = make_token().value(), other = make_token().value();
  ASSERT_TRUE(registry.add(record_of(token), kTokenNow).ok());
  const std::string forged = token.text.substr(0, token.text.rfind('_')) + other.text.substr(other.text.rfind('_'));
  const Status wrong_secret = registry.identify(forged, kTokenNow).status(),
               wrong_id = registry.identify(other.text, kTokenNow).status();
  EXPECT_EQ(wrong_secret.code(), StatusCode::kUnauthenticated);
  std::string expected = message_of(wrong_id);
  expected.replace(expected.find(other.id), other.id.size(), token.id);
  EXPECT_EQ(message_of(wrong_secret), expected);
  // All zeros are not the secret of any token, and identify no caller.
  EXPECT_FALSE(registry.identify("lightmill_000000000000_" + std::string(64, '0'), kTokenNow).ok());
}

TEST(TokenRegistry, RefusesInvalidRecords) {
  TokenRegistry registry;
  const NewToken token = make_token().value();
  const auto code = [&](auto change) {
    TokenRecord record = record_of(token);
    change(record);
    return registry.add(record, kTokenNow).code();
  };
  using enum StatusCode;
  EXPECT_EQ(code([](TokenRecord& r) { r.id = "short"; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.name.clear(); }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.name = "a\nb"; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.roles = {}; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.until_unix_s = kTokenNow; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.until_unix_s = kTokenNow + kMaxTokenSeconds + 1; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord&) {}), kOk);
  EXPECT_EQ(code([](TokenRecord&) {}), kOk) << "the same again is one token";
  EXPECT_EQ(code([](TokenRecord& r) { r.hash = sha256("other"); }), kAlreadyExists);
  EXPECT_EQ(code([](TokenRecord& r) { r.roles = {Role::admin}; }), kAlreadyExists);
  EXPECT_EQ(registry.all(), std::vector{record_of(token)});
}

class CallerTest : public ::testing::Test {
 protected:
  void SetUp() override { ::unsetenv(kTokenVariable); }
  void TearDown() override { ::unsetenv(kTokenVariable); }
  Result<CallerTexts> read(const std::string& file, const std::string& server) const {
    return read_caller({{}, file}, std::vector{server}, kTokenNow);
  }
  test::TemporaryFolder folder_;
  const std::string file_ = (folder_.path() / "token").string();
  const std::string text_ = make_token()->text;
};

TEST_F(CallerTest, TokensComeFromAFileOrTheEnvironment) {
  EXPECT_EQ(read("", "127.0.0.1:7350")->token, "");
  ::setenv(kTokenVariable, text_.c_str(), 1);
  EXPECT_EQ(read("", "127.0.0.1:7350")->token, text_);
  const std::string other = make_token()->text;
  ASSERT_TRUE(write_secret_file(file_, as_byte_view(other + "\n"), false).ok());
  EXPECT_EQ(read(file_, "127.0.0.1:7350")->token, other);
  ASSERT_EQ(::chmod(file_.c_str(), 0644), 0);
  EXPECT_NE(message_of(read(file_, "127.0.0.1:7350").status()).find("chmod 600"), std::string::npos);
  ASSERT_TRUE(write_file_atomically(file_, as_byte_view(std::string("\n"))).ok());
  ASSERT_EQ(::chmod(file_.c_str(), 0644), 0);
  EXPECT_EQ(message_of(read(file_, "127.0.0.1:7350").status()),
            fmt::format("--token-file {}: the file is empty: `lightmill tokens create` prints a token for it", file_));
  ASSERT_TRUE(write_secret_file(file_, as_byte_view(std::string("rubbish")), true).ok());
  EXPECT_NE(message_of(read(file_, "127.0.0.1:7350").status()).find("--token-file " + file_), std::string::npos);
}

TEST_F(CallerTest, TokensAreNotSentUnencrypted) {
  ::setenv(kTokenVariable, text_.c_str(), 1);
  for (const char* near : {"127.0.0.1:7350", "[::1]:7350", "localhost:7350"}) {
    EXPECT_TRUE(read("", near).ok()) << near;
  }
  for (const char* far : {"farm.example:7350", "10.0.0.1:7350", "127.evil.example:7350"}) {
    EXPECT_NE(message_of(read("", far).status()).find("--tls-ca"), std::string::npos) << far;
  }
}

}  // namespace
}  // namespace lightmill

// Enrolment tokens: number and names of the machines that get a token, and refusals.
#include <gtest/gtest.h>

#include <set>

#include "common/security/token.h"
#include "server/access/rights.h"
#include "server/access/token_registry.h"

namespace lightmill {
namespace {

using enum StatusCode;

constexpr std::int64_t kEnrolNow = 1'800'000'000, kEnrolDay = 86'400;

TokenRecord enrolment_token(const NewToken& token, std::uint32_t workers, const std::string& name = "render") {
  TokenRecord record{token.id, name, {Role::enrol}, token.hash, "root", kEnrolNow, kEnrolNow + kEnrolDay};
  record.enrolment = {workers, 0, 7 * kEnrolDay};
  return record;
}

/// A token registry with one enrolment token, and machines that show it.
class EnrolmentTest : public ::testing::Test {
 protected:
  void make(std::uint32_t workers) { ASSERT_TRUE(registry_.add(enrolment_token(token_, workers), kEnrolNow).ok()); }
  Identity bearer(std::int64_t now = kEnrolNow) const { return registry_.identify(token_.text, now).value(); }
  static EnrolmentRequest request(const std::string& host) {
    const NewToken own = make_token().value();
    return {own.id, own.hash, host};
  }
  Result<Enrolment> enrol(const std::string& host) { return registry_.enrol(bearer(), request(host), kEnrolNow); }
  std::string name_of_new(const std::string& host) {
    const Result<Enrolment> made = enrol(host);
    return made.ok() ? made->token.name : message_of(made.status());
  }

  const NewToken token_ = make_token().value();
  TokenRegistry registry_;
};

TEST_F(EnrolmentTest, ABearersOnlyRoleIsToEnrol) {
  make(1);
  EXPECT_EQ(bearer().roles, Roles{Role::enrol});
}

TEST_F(EnrolmentTest, AMachineGetsAWorkerTokenOfTheStatedLifetime) {
  make(1);
  const NewToken own = make_token().value();
  const Result<Enrolment> made = registry_.enrol(bearer(), {own.id, own.hash, "node7"}, kEnrolNow + 10);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_TRUE(made->is_new);
  EXPECT_EQ(made->by.enrolment.enrolled, 1u);
  EXPECT_EQ(*registry_.find(token_.id), made->by);
  EXPECT_EQ(*registry_.find(own.id), made->token);
  EXPECT_EQ(made->token.enrolled_by, token_.id);
  EXPECT_EQ(made->token.until_unix_s, kEnrolNow + 10 + 7 * kEnrolDay);
  const Identity machine = registry_.identify(own.text, kEnrolNow + 7 * kEnrolDay).value();
  EXPECT_EQ(machine.name, "render/node7");
  EXPECT_EQ(machine.roles, Roles{Role::worker});
}

TEST_F(EnrolmentTest, MachinesGetDifferentNames) {
  make(9);
  EXPECT_EQ(name_of_new("node7"), "render/node7");
  EXPECT_EQ(name_of_new("node7"), "render/node7-2");
  EXPECT_EQ(name_of_new("node7-2"), "render/node7-2-2");
  EXPECT_EQ(name_of_new(""), "render/1");
  EXPECT_EQ(name_of_new(""), "render/2");
  const NewToken other = make_token().value();
  ASSERT_TRUE(registry_.add(enrolment_token(other, 5), kEnrolNow).ok());
  const auto by_other = registry_.enrol(registry_.identify(other.text, kEnrolNow).value(), request("node7"), kEnrolNow);
  EXPECT_EQ(by_other->token.name, "render/node7-3") << "another enrolment token of the same name";
}

TEST_F(EnrolmentTest, UsesAreLimited) {
  make(2);
  EXPECT_TRUE(enrol("a").ok());
  EXPECT_TRUE(enrol("b").ok());
  const Status refused = enrol("c").status();
  EXPECT_EQ(refused.code(), kPermissionDenied);
  EXPECT_EQ(message_of(refused),
            fmt::format("the enrolment token {} of 'render' has enrolled all of its 2 workers: an admin can create "
                        "another with `lightmill tokens create render --enrol N`",
                        token_.id));
  // Revoking a machine's token returns no use. Otherwise an excluded machine could come again without end.
  ASSERT_TRUE(registry_.remove(registry_.enrolled_by(token_.id).front()).ok());
  EXPECT_EQ(enrol("c").status().code(), kPermissionDenied);
}

TEST_F(EnrolmentTest, TheOnlyUseOfATokenIsNamedAsOne) {
  make(1);
  EXPECT_TRUE(enrol("a").ok());
  EXPECT_NE(message_of(enrol("b").status()).find("has enrolled its only worker: an admin can"), std::string::npos);
}

TEST_F(EnrolmentTest, ARepeatedRequestCountsOnce) {
  make(2);
  const EnrolmentRequest first = request("a");
  const Result<Enrolment> made = registry_.enrol(bearer(), first, kEnrolNow);
  EnrolmentRequest again = first;
  again.host = "renamed meanwhile";
  for (int i = 0; i < 3; ++i) {
    const Result<Enrolment> repeated = registry_.enrol(bearer(), again, kEnrolNow + 5);
    ASSERT_TRUE(repeated.ok()) << repeated.status();
    EXPECT_FALSE(repeated->is_new);
    EXPECT_EQ(repeated->token, made->token);
  }
  EXPECT_TRUE(enrol("b").ok()) << "its second use";
  EXPECT_FALSE(enrol("c").ok());
  EXPECT_TRUE(registry_.enrol(bearer(), first, kEnrolNow).ok())
      << "an answer that was lost, though all uses are taken now";
  again.hash = sha256("another secret");
  EXPECT_EQ(registry_.enrol(bearer(), again, kEnrolNow).status().code(), kAlreadyExists);
  const TokenRecord& itself = *registry_.find(token_.id);
  EXPECT_EQ(registry_.enrol(bearer(), {itself.id, itself.hash, "x"}, kEnrolNow).status().code(), kAlreadyExists)
      << "a manual token";
}

TEST_F(EnrolmentTest, ExpiredAndRevokedTokensAreRefused) {
  make(5);
  const Identity before = bearer();
  EXPECT_EQ(registry_.identify(token_.text, kEnrolNow + kEnrolDay).status().code(), kUnauthenticated);
  ASSERT_TRUE(registry_.remove(token_.id).ok());
  EXPECT_EQ(registry_.identify(token_.text, kEnrolNow).status().code(), kUnauthenticated);
  EXPECT_EQ(registry_.enrol(before, request("a"), kEnrolNow).status().code(), kUnauthenticated) << "revoked on its way";
  EXPECT_EQ(registry_.enrol(anonymous_identity(), request("a"), kEnrolNow).status().code(), kUnauthenticated);
}

TEST_F(EnrolmentTest, EnrolledMachinesAreKnownAfterTheTokenIsRemoved) {
  make(3);
  std::set<std::string> ids;
  for (const char* host : {"a", "b"}) {
    ids.insert(enrol(host)->token.id);
  }
  ASSERT_TRUE(registry_.remove(token_.id).ok());
  const std::vector<std::string> found = registry_.enrolled_by(token_.id);
  EXPECT_EQ(std::set(found.begin(), found.end()), ids);
  EXPECT_TRUE(registry_.enrolled_by("").empty()) << "manual tokens do not count";
}

TEST_F(EnrolmentTest, ExpiredMachineTokensMakeRoom) {
  make(3);
  const std::string first = enrol("a")->token.id;
  const std::int64_t later = kEnrolNow + 8 * kEnrolDay;
  const NewToken fresh = make_token().value(), by_hand = make_token().value();
  TokenRecord another = enrolment_token(fresh, 3);
  another.until_unix_s = later + kEnrolDay;
  ASSERT_TRUE(registry_.add(another, later).ok());
  const TokenRecord old{by_hand.id, "ada", {Role::view}, by_hand.hash, "root", kEnrolNow, kEnrolNow + 1};
  ASSERT_TRUE(registry_.add(old, kEnrolNow).ok());
  const Result<Enrolment> made = registry_.enrol(registry_.identify(fresh.text, later).value(), request("a"), later);
  ASSERT_TRUE(made.ok()) << made.status();
  EXPECT_EQ(made->ended, std::vector{first});
  EXPECT_EQ(made->token.name, "render/a");
  EXPECT_EQ(registry_.find(first), nullptr);
  EXPECT_NE(registry_.find(by_hand.id), nullptr) << "people look for theirs";
}

TEST_F(EnrolmentTest, InvalidEnrolmentTokensAreRefused) {
  const auto code = [&](auto change) {
    TokenRecord record = enrolment_token(token_, 5);
    change(record);
    return TokenRegistry().add(record, kEnrolNow).code();
  };
  EXPECT_EQ(code([](TokenRecord&) {}), kOk);
  EXPECT_EQ(code([](TokenRecord& r) { r.roles.add(Role::worker); }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.roles = {Role::worker}; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.enrolment.workers = 0; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.enrolment.workers = kMaxEnrolments + 1; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.enrolment.worker_seconds = 0; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.enrolment.worker_seconds = kMaxTokenSeconds + 1; }), kInvalidArgument);
  EXPECT_EQ(code([](TokenRecord& r) { r.name = std::string(kMaxEnrolmentNameBytes + 1, 'x'); }), kInvalidArgument);
  make(9);
  for (const std::string& host : {std::string("a/b"), std::string("a\nb"), std::string(65, 'x'), std::string("\xff")}) {
    EXPECT_EQ(enrol(host).status().code(), kInvalidArgument) << host;
  }
  EXPECT_EQ(registry_.enrol(bearer(), {"short", {}, "a"}, kEnrolNow).status().code(), kInvalidArgument);
  EXPECT_EQ(registry_.find(token_.id)->enrolment.enrolled, 0u) << "a refusal counts no use";
}

TEST_F(EnrolmentTest, AnEnrolmentIntoAFullRegistryCountsNoUse) {
  make(5);
  for (std::size_t i = 1; i < kMaxTokens; ++i) {
    const std::string id = fmt::format("{:012x}", i);
    ASSERT_TRUE(registry_.add({id, "ada", {Role::view}, {}, "root", kEnrolNow, kEnrolNow + 1}, kEnrolNow).ok());
  }
  EXPECT_EQ(enrol("a").status().code(), kResourceExhausted);
  EXPECT_EQ(registry_.find(token_.id)->enrolment.enrolled, 0u);
}

}  // namespace
}  // namespace lightmill

// Certificates: they have the requested contents, and OpenSSL's own verification accepts them only for their purpose.
#include "common/security/certificate.h"

#include <gtest/gtest.h>
#include <openssl/bio.h>
#include <openssl/pem.h>
#include <openssl/x509_vfy.h>
#include <openssl/x509v3.h>
#include <sys/stat.h>

#include "common/base/file.h"
#include "common/security/authority.h"
#include "common/security/caller.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

constexpr std::int64_t kCertificateNow = 1'800'000'000;  // 2027-01-15 08:00 UTC
constexpr Validity kValidity{kCertificateNow - 300, kCertificateNow + 86'400};

KeyAndCertificate authority() {
  return make_authority("Test farm", {kCertificateNow - 300, kCertificateNow + 10 * 86'400}).value();
}

CertificateFacts facts_of(const KeyAndCertificate& made) {
  return read_certificates(made.certificate).value().front();
}

using Owned = std::unique_ptr<X509, decltype(&X509_free)>;

Owned parsed(const std::string& pem) {
  BIO* const bio = BIO_new_mem_buf(pem.data(), static_cast<int>(pem.size()));
  Owned certificate(PEM_read_bio_X509(bio, nullptr, nullptr, nullptr), &X509_free);
  BIO_free(bio);
  return certificate;
}

/// X509_V_OK or the error at time `at`, by OpenSSL's own code, which shares nothing with ours.
int verify(const KeyAndCertificate& made, const KeyAndCertificate& by, int purpose, std::int64_t at = kCertificateNow) {
  const Owned issuer = parsed(by.certificate), certificate = parsed(made.certificate);
  X509_STORE* const store = X509_STORE_new();
  X509_STORE_add_cert(store, issuer.get());
  X509_STORE_CTX* const context = X509_STORE_CTX_new();
  X509_STORE_CTX_init(context, store, certificate.get(), nullptr);
  X509_VERIFY_PARAM_set_time(X509_STORE_CTX_get0_param(context), static_cast<std::time_t>(at));
  X509_STORE_CTX_set_purpose(context, purpose);
  X509_VERIFY_PARAM_set_flags(X509_STORE_CTX_get0_param(context), X509_V_FLAG_X509_STRICT);
  (void)X509_verify_cert(context);
  const int code = X509_STORE_CTX_get_error(context);
  X509_STORE_CTX_free(context);
  X509_STORE_free(store);
  return code;
}

TEST(Certificates, HaveTheRequestedContents) {
  const KeyAndCertificate ca = authority();
  EXPECT_TRUE(facts_of(ca).authority);
  EXPECT_EQ(facts_of(ca).name, "Test farm");
  EXPECT_EQ(facts_of(ca).issuer, "Test farm");

  const auto server =
      issue_certificate(ca, {"farm", {"farm.example", "*.farm.example", "10.0.0.5", "::1"}, {}}, kValidity);
  ASSERT_TRUE(server.ok()) << server.status();
  EXPECT_EQ(facts_of(*server).hosts, (std::vector<std::string>{"farm.example", "*.farm.example", "10.0.0.5", "::1"}));
  EXPECT_TRUE(facts_of(*server).roles.empty());
  EXPECT_FALSE(facts_of(*server).authority);

  const auto person = issue_certificate(ca, {"Ada Lövelace", {}, {Role::view, Role::submit}}, kValidity);
  ASSERT_TRUE(person.ok()) << person.status();
  const CertificateFacts facts = facts_of(*person);
  EXPECT_EQ(facts.name, "Ada Lövelace");
  EXPECT_EQ(facts.issuer, "Test farm");
  EXPECT_EQ(facts.roles, (Roles{Role::view, Role::submit}));
  EXPECT_EQ(facts.from_unix_s, kValidity.from_unix_s);
  EXPECT_EQ(facts.until_unix_s, kValidity.until_unix_s);
  EXPECT_EQ(date_text(kCertificateNow), "2027-01-15 08:00 UTC");
}

TEST(Certificates, AreValidOnlyForTheirPurpose) {
  const KeyAndCertificate ca = authority(), other = make_authority("Test farm", kValidity).value();
  const KeyAndCertificate server = issue_certificate(ca, {"s", {"farm.example"}, {}}, kValidity).value();
  const KeyAndCertificate worker = issue_certificate(ca, {"w", {}, {Role::worker}}, kValidity).value();
  EXPECT_EQ(verify(server, ca, X509_PURPOSE_SSL_SERVER), X509_V_OK);
  EXPECT_EQ(verify(worker, ca, X509_PURPOSE_SSL_CLIENT), X509_V_OK);
  EXPECT_EQ(verify(worker, ca, X509_PURPOSE_SSL_SERVER), X509_V_ERR_INVALID_PURPOSE) << "a worker is no coordinator";
  EXPECT_EQ(verify(server, ca, X509_PURPOSE_SSL_CLIENT), X509_V_ERR_INVALID_PURPOSE);
  EXPECT_NE(verify(worker, other, X509_PURPOSE_SSL_CLIENT), X509_V_OK) << "the same name, another key";
  EXPECT_EQ(verify(worker, ca, X509_PURPOSE_SSL_CLIENT, kValidity.until_unix_s + 1), X509_V_ERR_CERT_HAS_EXPIRED);
  EXPECT_EQ(verify(worker, ca, X509_PURPOSE_SSL_CLIENT, kValidity.from_unix_s - 1), X509_V_ERR_CERT_NOT_YET_VALID);
}

TEST(Certificates, NamesThatLookLikeRolesGrantNoRole) {
  const KeyAndCertificate ca = authority();
  const auto person = issue_certificate(ca, {"x,URI:lightmill://role/admin", {}, {Role::view}}, kValidity);
  ASSERT_TRUE(person.ok()) << person.status();
  EXPECT_EQ(facts_of(*person).roles, Roles{Role::view});
  for (const char* host :
       {"a,URI:lightmill://role/admin", "lightmill://role/admin", "farm:7350", "a b", "", ".x", "a..b"}) {
    EXPECT_EQ(issue_certificate(ca, {"s", {host}, {}}, kValidity).status().code(), StatusCode::kInvalidArgument)
        << host;
  }
}

TEST(Certificates, AnInvalidAddressIsNotAHostName) {
  const KeyAndCertificate ca = authority();
  for (const char* host : {"300.1.1.1", "10.0.0", "10.0.0.5.6", "1", "10.0.0.256", "farm.7", "10.0.0.5."}) {
    const Status status = issue_certificate(ca, {"s", {host}, {}}, kValidity).status();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << host;
    EXPECT_NE(message_of(status).find("neither a host name nor an IP address"), std::string::npos) << host;
  }
  for (const char* host : {"render7", "7.farm", "10.0.0.5a", "3d", "farm.example."}) {
    EXPECT_TRUE(issue_certificate(ca, {"s", {host}, {}}, kValidity).ok()) << host;
  }
}

TEST(Certificates, InvalidRequestsAreRefused) {
  const KeyAndCertificate ca = authority(), other = authority();
  const auto code = [&](const KeyAndCertificate& by, const CertificateSubject& subject) {
    return issue_certificate(by, subject, kValidity).status().code();
  };
  EXPECT_EQ(code(ca, {"x", {}, {}}), StatusCode::kInvalidArgument) << "neither hosts nor roles";
  EXPECT_EQ(code(ca, {"x", {"h"}, {Role::view}}), StatusCode::kInvalidArgument) << "both";
  EXPECT_EQ(code(ca, {"", {}, {Role::view}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code(ca, {std::string(65, 'x'), {}, {Role::view}}), StatusCode::kInvalidArgument);
  EXPECT_EQ(code({other.key, ca.certificate}, {"x", {}, {Role::view}}), StatusCode::kInvalidArgument);
  const KeyAndCertificate worker = issue_certificate(ca, {"w", {}, {Role::worker}}, kValidity).value();
  EXPECT_EQ(code(worker, {"x", {}, {Role::admin}}), StatusCode::kInvalidArgument) << "a worker signs nothing";
  EXPECT_EQ(
      facts_of(
          issue_certificate(ca, {"x", {}, {Role::view}}, {kCertificateNow, kCertificateNow + 100 * 86'400}).value())
          .until_unix_s,
      facts_of(ca).until_unix_s)
      << "none outlives its authority";
}

TEST(Roles, SurviveARoundTripThroughText) {
  EXPECT_EQ(parse_roles("view,submit").value(), (Roles{Role::view, Role::submit}));
  EXPECT_EQ(parse_roles(names_of(Roles::all())).value(), Roles::all());
  for (const char* bad : {"", "view,", "root", "View", "view submit"}) {
    EXPECT_EQ(parse_roles(bad).status().code(), StatusCode::kInvalidArgument) << bad;
  }
  EXPECT_EQ(message_of(parse_roles("boss").status()),
            "unknown role 'boss'. Known roles: view, submit, operate, worker, admin");
}

class TlsFilesTest : public ::testing::Test {
 protected:
  std::string file(const std::string& name, const std::string& text, mode_t mode = 0600) {
    const std::filesystem::path path = folder_.path() / name;
    EXPECT_TRUE(write_secret_file(path, as_byte_view(text), true).ok());
    EXPECT_EQ(::chmod(path.c_str(), mode), 0);
    return path.string();
  }
  std::string problem(const TlsFiles& files, std::int64_t now = kCertificateNow) {
    return message_of(read_tls_files(files, now).status());
  }
  test::TemporaryFolder folder_;
  KeyAndCertificate ca_ = authority();
  KeyAndCertificate worker_ = issue_certificate(ca_, {"w", {}, {Role::worker}}, kValidity).value();
};

TEST_F(TlsFilesTest, OneFileCanHoldKeyAndCertificate) {
  const TlsFiles one{file("ca.pem", ca_.certificate), file("w.pem", worker_.certificate + worker_.key), ""};
  const TlsFiles two{one.authority, file("c.pem", worker_.certificate), file("k.pem", worker_.key)};
  for (const TlsFiles& files : {one, two}) {
    const auto texts = read_tls_files(files, kCertificateNow);
    ASSERT_TRUE(texts.ok()) << texts.status();
    EXPECT_EQ(read_certificates(texts->certificate)->front().name, "w");
  }
  EXPECT_NE(message_of(check_names_hosts(read_tls_files(one, kCertificateNow).value())).find("names no host"),
            std::string::npos);
}

TEST_F(TlsFilesTest, MistakesAreNamed) {
  const std::string good = file("w.pem", worker_.certificate + worker_.key), ca = file("ca.pem", ca_.certificate);
  const std::string bare = file("bare.pem", worker_.certificate);
  EXPECT_NE(problem({ca, bare, ""}).find("--tls-cert " + bare + ": there is no private key"), std::string::npos)
      << problem({ca, bare, ""});
  EXPECT_NE(problem({ca, bare, file("other.key", ca_.key)}).find("does not match the certificate"), std::string::npos);
  EXPECT_NE(problem({good, good, ""}).find("is not that of an authority"), std::string::npos);
  EXPECT_NE(problem({ca, good, ""}, kValidity.until_unix_s).find("expired 2027-01-16 08:00 UTC: renew it"),
            std::string::npos);
  EXPECT_NE(problem({ca, good, ""}, kValidity.from_unix_s - 1).find("clock"), std::string::npos);
  EXPECT_NE(problem({ca, "", good}).find("without its certificate"), std::string::npos);
  EXPECT_NE(problem({ca, file("open.pem", worker_.certificate + worker_.key, 0644), ""}).find("chmod 600"),
            std::string::npos);
  EXPECT_NE(problem({(folder_.path() / "none").string(), "", ""}).find("--tls-ca"), std::string::npos);
  EXPECT_NE(problem({file("text.pem", "no PEM"), "", ""}).find("no certificate in it"), std::string::npos);
  EXPECT_NE(message_of(read_caller({{"", good, ""}, ""}, {}, kCertificateNow).status()).find("without --tls-ca"),
            std::string::npos);
}

TEST_F(TlsFilesTest, SecretFilesArePrivateAndNotOverwritten) {
  const std::filesystem::path path = folder_.path() / "secret";
  ASSERT_TRUE(write_secret_file(path, as_byte_view("one"), false).ok());
  struct stat info {};
  ASSERT_EQ(::stat(path.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  EXPECT_EQ(write_secret_file(path, as_byte_view("two"), false).code(), StatusCode::kAlreadyExists);
  EXPECT_EQ(read_file(path).value(), "one");
  ASSERT_TRUE(write_secret_file(path, as_byte_view("three"), true).ok());
  EXPECT_EQ(read_file(path).value(), "three");
  ASSERT_EQ(::stat(path.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_.path()), std::filesystem::directory_iterator()),
            1)
      << "nothing else is left";
}

}  // namespace
}  // namespace lightmill

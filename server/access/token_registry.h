// Token registry: the farm's tokens and the identities that they prove.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "server/access/identity.h"

namespace lightmill {

/// Terms of an enrolment token.
struct EnrolmentTerms {
  std::uint32_t workers = 0;        ///< how many workers may enrol
  std::uint32_t enrolled = 0;       ///< how many have enrolled
  std::int64_t worker_seconds = 0;  ///< lifetime of their tokens
  friend bool operator==(const EnrolmentTerms&, const EnrolmentTerms&) = default;
};

/// A stored token.
struct TokenRecord {
  std::string id;
  std::string name;  ///< name of its identity
  Roles roles;
  Sha256 hash;          ///< of the whole token
  std::string made_by;  ///< name of the caller who created it
  std::int64_t made_unix_s = 0, until_unix_s = 0;
  EnrolmentTerms enrolment = {};
  std::string enrolled_by = {};  ///< id of the enrolment token; empty: created by a person
  friend bool operator==(const TokenRecord&, const TokenRecord&) = default;
};

/// Request of a machine that enrols. The machine draws the secret itself, so a repeated request is the same request.
struct EnrolmentRequest {
  std::string id;
  Sha256 hash;
  std::string host;  ///< the machine's own name; may be empty
};

struct Enrolment {
  TokenRecord token;  ///< the machine's
  TokenRecord by;     ///< the enrolment token's current state
  bool is_new = false;
  std::vector<std::string> ended;  ///< expired tokens of machines, which were removed
};

inline constexpr std::uint32_t kMaxEnrolments = 10'000;
/// Limit of an enrolment token's name and of a host's name, so a worker's name has room for the rest.
inline constexpr std::size_t kMaxEnrolmentNameBytes = 64;
inline constexpr std::size_t kMaxTokens = 10'000;
inline constexpr std::int64_t kMaxTokenSeconds = std::int64_t{3650} * 24 * 60 * 60;

/// Not thread-safe.
class TokenRegistry {
 public:
  explicit TokenRegistry(std::vector<TokenRecord> tokens = {});

  /// The identity of a token. UNAUTHENTICATED does not tell whether the id or the secret is wrong.
  Result<Identity> identify(std::string_view text, std::int64_t now_unix_s) const;
  /// For an identity by token: UNAUTHENTICATED if the token was revoked or has expired.
  Status check_still_holds(const Identity& identity, std::int64_t now_unix_s) const;

  /// INVALID_ARGUMENT for an invalid id, name, role or end. ALREADY_EXISTS if another token has the id.
  /// RESOURCE_EXHAUSTED beyond kMaxTokens. The same token again changes nothing. A token with the role enrol has no
  /// other role.
  Status add(const TokenRecord& token, std::int64_t now_unix_s);
  /// Gives a machine a token with the role worker and a unique name: "NAME/HOST", "NAME/HOST-2", …, or "NAME/1", …
  /// without a host. `by` authenticated with an enrolment token. This is one use of it. A repeated request changes
  /// nothing. INVALID_ARGUMENT, ALREADY_EXISTS, PERMISSION_DENIED if all uses are taken, UNAUTHENTICATED if `by` was
  /// revoked meanwhile, RESOURCE_EXHAUSTED beyond kMaxTokens.
  Result<Enrolment> enrol(const Identity& by, const EnrolmentRequest& request, std::int64_t now_unix_s);
  /// Ids of all tokens that this enrolment token created. It may be removed already.
  std::vector<std::string> enrolled_by(std::string_view id) const;
  /// NOT_FOUND.
  Status remove(std::string_view id);
  const TokenRecord* find(std::string_view id) const;
  std::vector<TokenRecord> all() const;  ///< sorted by id

 private:
  Status check_room() const;
  std::string free_name(const std::string& of, const std::string& host) const;
  std::map<std::string, TokenRecord, std::less<>> tokens_;
};

}  // namespace lightmill

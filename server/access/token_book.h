// The tokens that a farm knows, and whom each stands for.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/digest.h"
#include "common/base/status.h"
#include "server/access/identity.h"

namespace lightmill {

/// What a token of the role enrol gives.
struct EnrolmentTerms {
  std::uint32_t workers = 0;        ///< so many workers may enrol
  std::uint32_t enrolled = 0;       ///< so many have
  std::int64_t worker_seconds = 0;  ///< their tokens hold so long
  friend bool operator==(const EnrolmentTerms&, const EnrolmentTerms&) = default;
};

/// All that is kept of a token.
struct TokenRecord {
  std::string id;
  std::string name;  ///< whom it stands for
  Roles roles;
  Sha256 hash;          ///< of its text
  std::string made_by;  ///< who has had it made
  std::int64_t made_unix_s = 0, until_unix_s = 0;
  EnrolmentTerms enrolment = {};
  std::string enrolled_by = {};  ///< the id of the token by which its bearer enrolled; empty: it was made by hand
  friend bool operator==(const TokenRecord&, const TokenRecord&) = default;
};

/// What a machine asks for that enrols. It has drawn the secret itself, so that a repeated request is the same one.
struct EnrolmentRequest {
  std::string id;
  Sha256 hash;
  std::string host;  ///< what it calls itself; may be empty
};

struct Enrolment {
  TokenRecord token;  ///< the machine's
  TokenRecord by;     ///< the enrolment token, as it is now
  bool is_new = false;
  std::vector<std::string> ended;  ///< tokens of machines that have ended, and were removed
};

inline constexpr std::uint32_t kMaxEnrolments = 10'000;
/// Of an enrolment token's name, and of a host's: what follows them has room in a worker's name.
inline constexpr std::size_t kMaxEnrolmentNameBytes = 64;
inline constexpr std::size_t kMaxTokens = 10'000;
inline constexpr std::int64_t kMaxTokenSeconds = std::int64_t{3650} * 24 * 60 * 60;

/// Not thread-safe.
class TokenBook {
 public:
  explicit TokenBook(std::vector<TokenRecord> tokens = {});

  /// Whom the token stands for. UNAUTHENTICATED does not say whether the id or the secret is unknown.
  Result<Identity> identify(std::string_view text, std::int64_t now_unix_s) const;
  /// Of an identity by token: whether it has neither been revoked nor ended.
  Status check_still_holds(const Identity& identity, std::int64_t now_unix_s) const;

  /// INVALID_ARGUMENT for an id, a name, roles or an end that cannot be, ALREADY_EXISTS if the id is another token's,
  /// RESOURCE_EXHAUSTED beyond kMaxTokens. The same token again changes nothing.
  /// A token of the role enrol has no other role.
  Status add(const TokenRecord& token, std::int64_t now_unix_s);
  /// Gives a machine a token with the role worker and a name that no other token has: "NAME/HOST", "NAME/HOST-2" and so
  /// on; "NAME/1" and so on without a host. `by` has shown an enrolment token, of which it is one use. The same request
  /// again changes nothing. INVALID_ARGUMENT, ALREADY_EXISTS, PERMISSION_DENIED if all uses are taken, UNAUTHENTICATED
  /// if `by` was revoked meanwhile, RESOURCE_EXHAUSTED beyond kMaxTokens.
  Result<Enrolment> enrol(const Identity& by, const EnrolmentRequest& request, std::int64_t now_unix_s);
  /// The ids of all tokens that machines were given by this one, which may be gone.
  std::vector<std::string> enrolled_by(std::string_view id) const;
  /// NOT_FOUND.
  Status remove(std::string_view id);
  const TokenRecord* find(std::string_view id) const;
  std::vector<TokenRecord> all() const;  ///< by their ids

 private:
  Status check_room() const;
  std::string free_name(const std::string& of, const std::string& host) const;
  std::map<std::string, TokenRecord, std::less<>> tokens_;
};

}  // namespace lightmill

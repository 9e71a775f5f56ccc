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

/// All that is kept of a token.
struct TokenRecord {
  std::string id;
  std::string name;  ///< whom it stands for
  Roles roles;
  Sha256 hash;          ///< of its text
  std::string made_by;  ///< who has had it made
  std::int64_t made_unix_s = 0, until_unix_s = 0;
  friend bool operator==(const TokenRecord&, const TokenRecord&) = default;
};

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
  Status add(const TokenRecord& token, std::int64_t now_unix_s);
  /// NOT_FOUND.
  Status remove(std::string_view id);
  const TokenRecord* find(std::string_view id) const;
  std::vector<TokenRecord> all() const;  ///< by their ids

 private:
  std::map<std::string, TokenRecord, std::less<>> tokens_;
};

}  // namespace lightmill

#include "server/access/token_book.h"

#include "common/base/text.h"
#include "common/security/token.h"

namespace lightmill {

TokenBook::TokenBook(std::vector<TokenRecord> tokens) {
  for (TokenRecord& token : tokens) {
    std::string id = token.id;
    tokens_.emplace(std::move(id), std::move(token));
  }
}

Result<Identity> TokenBook::identify(std::string_view text, std::int64_t now_unix_s) const {
  const Result<std::string> id = token_id(text);
  if (!id.ok()) {
    return make_error(StatusCode::kUnauthenticated, "{}", message_of(id.status()));
  }
  const TokenRecord* const token = find(*id);
  // Always hashed and compared, so that how long it takes tells nothing of which ids there are.
  const bool same = same_digest(sha256(text), token != nullptr ? token->hash : Sha256{});
  if (token == nullptr || !same) {
    return make_error(StatusCode::kUnauthenticated,
                      "the token {}… is unknown here: it was revoked, or is another farm's", *id);
  }
  Identity identity{token->name, token->roles, Proof::token, token->until_unix_s, token->id};
  LM_RETURN_IF_ERROR(lightmill::check_still_holds(identity, now_unix_s));
  return identity;
}

Status TokenBook::check_still_holds(const Identity& identity, std::int64_t now_unix_s) const {
  if (find(identity.token) == nullptr) {
    return make_error(StatusCode::kUnauthenticated, "the token {} was revoked", identity.token);
  }
  return lightmill::check_still_holds(identity, now_unix_s);
}

Status TokenBook::add(const TokenRecord& token, std::int64_t now_unix_s) {
  if (!is_token_id(token.id)) {
    return invalid_argument("id: a token's has 12 hex digits, got '{}'", printable(token.id));
  }
  LM_RETURN_IF_ERROR(check_name("name", token.name));
  if (token.name.empty() || token.roles.empty()) {
    return invalid_argument("a token needs a name and a role");
  }
  if (token.until_unix_s <= now_unix_s || token.until_unix_s > now_unix_s + kMaxTokenSeconds) {
    return invalid_argument("a token ends within {} days, got {}", kMaxTokenSeconds / (24 * 60 * 60),
                            date_text(token.until_unix_s));
  }
  if (const TokenRecord* const there = find(token.id)) {
    const bool same = same_digest(there->hash, token.hash) && there->name == token.name && there->roles == token.roles;
    return same ? ok_status() : already_exists("there is another token {}", token.id);
  }
  if (tokens_.size() >= kMaxTokens) {
    return resource_exhausted("there are {} tokens, and no more are kept: revoke some", kMaxTokens);
  }
  tokens_.emplace(token.id, token);
  return ok_status();
}

Status TokenBook::remove(std::string_view id) {
  const auto at = tokens_.find(id);
  if (at == tokens_.end()) {
    return not_found("there is no token {}", printable(id));
  }
  tokens_.erase(at);
  return ok_status();
}

const TokenRecord* TokenBook::find(std::string_view id) const {
  const auto at = tokens_.find(id);
  return at == tokens_.end() ? nullptr : &at->second;
}

std::vector<TokenRecord> TokenBook::all() const {
  std::vector<TokenRecord> tokens;
  for (const auto& [id, token] : tokens_) {
    tokens.push_back(token);
  }
  return tokens;
}

}  // namespace lightmill

#include "server/access/token_registry.h"

#include <set>

#include "common/base/text.h"
#include "common/security/token.h"

namespace lightmill {
namespace {

Status check_id(const std::string& id) {
  return is_token_id(id) ? ok_status() : invalid_argument("id: must have 12 hex digits, got '{}'", printable(id));
}

/// Checks the terms of a new token: it enrols workers and does nothing else, or it enrols none.
Status check_enrolment(const TokenRecord& token) {
  const EnrolmentTerms& terms = token.enrolment;
  if (!token.roles.has(Role::enrol)) {
    return terms == EnrolmentTerms() ? ok_status()
                                     : invalid_argument("enrolment: only a token with the role enrol enrols workers");
  }
  if (token.roles != Roles{Role::enrol} || terms.workers < 1 || terms.workers > kMaxEnrolments) {
    return invalid_argument(
        "an enrolment token must have only the role enrol, and 1 to {} workers, got the roles {} and {} workers "
        "(lightmill tokens create NAME --enrol N)",
        kMaxEnrolments, names_of(token.roles), terms.workers);
  }
  if (terms.worker_seconds < 1 || terms.worker_seconds > kMaxTokenSeconds) {
    return invalid_argument("enrolment: the token of a worker must be valid for 1 to {} s, got {}", kMaxTokenSeconds,
                            terms.worker_seconds);
  }
  return token.name.size() <= kMaxEnrolmentNameBytes
             ? ok_status()
             : invalid_argument("name: the name of an enrolment token must have at most {} bytes, got {}",
                                kMaxEnrolmentNameBytes, token.name.size());
}

/// A slash would make the name look like one of another token.
Status check_host(const std::string& host) {
  LM_RETURN_IF_ERROR(check_name("host", host));
  return host.size() <= kMaxEnrolmentNameBytes && host.find('/') == std::string::npos
             ? ok_status()
             : invalid_argument("host: must have at most {} bytes and no slash, got '{}'", kMaxEnrolmentNameBytes,
                                host);
}

}  // namespace

TokenRegistry::TokenRegistry(std::vector<TokenRecord> tokens) {
  for (TokenRecord& token : tokens) {
    std::string id = token.id;
    tokens_.emplace(std::move(id), std::move(token));
  }
}

Result<Identity> TokenRegistry::identify(std::string_view text, std::int64_t now_unix_s) const {
  const Result<std::string> id = token_id(text);
  if (!id.ok()) {
    return make_error(StatusCode::kUnauthenticated, "{}", message_of(id.status()));
  }
  const TokenRecord* const token = find(*id);
  // Always hashes and compares, so the time does not tell which ids exist.
  const bool same = same_digest(sha256(text), token != nullptr ? token->hash : Sha256{});
  if (token == nullptr || !same) {
    return make_error(StatusCode::kUnauthenticated,
                      "the token {}… is unknown here: it was revoked, or belongs to another farm. Ask an admin for "
                      "a new one",
                      *id);
  }
  Identity identity{token->name, token->roles, Proof::token, token->until_unix_s, token->id};
  LM_RETURN_IF_ERROR(lightmill::check_still_holds(identity, now_unix_s));
  return identity;
}

Status TokenRegistry::check_still_holds(const Identity& identity, std::int64_t now_unix_s) const {
  if (find(identity.token) == nullptr) {
    return make_error(StatusCode::kUnauthenticated, "the token {} was revoked", identity.token);
  }
  return lightmill::check_still_holds(identity, now_unix_s);
}

Status TokenRegistry::add(const TokenRecord& token, std::int64_t now_unix_s) {
  LM_RETURN_IF_ERROR(check_id(token.id));
  LM_RETURN_IF_ERROR(check_name("name", token.name));
  if (token.name.empty() || token.roles.empty()) {
    return invalid_argument("a token needs a name and a role");
  }
  if (token.until_unix_s <= now_unix_s || token.until_unix_s > now_unix_s + kMaxTokenSeconds) {
    return invalid_argument("a token must end within {} days, got {}", kMaxTokenSeconds / (24 * 60 * 60),
                            date_text(token.until_unix_s));
  }
  LM_RETURN_IF_ERROR(check_enrolment(token));
  if (const TokenRecord* const there = find(token.id)) {
    const bool same = same_digest(there->hash, token.hash) && there->name == token.name &&
                      there->roles == token.roles && there->enrolment.workers == token.enrolment.workers;
    return same ? ok_status() : already_exists("there is already another token {}", token.id);
  }
  LM_RETURN_IF_ERROR(check_room());
  tokens_.emplace(token.id, token);
  return ok_status();
}

Status TokenRegistry::check_room() const {
  return tokens_.size() < kMaxTokens
             ? ok_status()
             : resource_exhausted("there are {} tokens, which is the limit: revoke some", kMaxTokens);
}

Result<Enrolment> TokenRegistry::enrol(const Identity& by, const EnrolmentRequest& request, std::int64_t now_unix_s) {
  LM_RETURN_IF_ERROR(check_id(request.id));
  LM_RETURN_IF_ERROR(check_host(request.host));
  const auto at = tokens_.find(by.token);
  if (at == tokens_.end() || at->second.enrolment.workers == 0) {
    return make_error(StatusCode::kUnauthenticated, "{} has no enrolment token, or it was revoked", describe(by));
  }
  TokenRecord& enrolling = at->second;
  if (const TokenRecord* const there = find(request.id)) {
    return there->enrolled_by.empty() || !same_digest(there->hash, request.hash)
               ? Result<Enrolment>(already_exists("there is already another token {}", request.id))
               : Enrolment{*there, enrolling, false, {}};
  }
  EnrolmentTerms& terms = enrolling.enrolment;
  if (terms.enrolled >= terms.workers) {
    return make_error(StatusCode::kPermissionDenied,
                      "the enrolment token {} of '{}' has enrolled {}: an admin can create another with `lightmill "
                      "tokens create {} --enrol N`",
                      enrolling.id, enrolling.name,
                      terms.workers == 1 ? "its only worker" : fmt::format("all of its {} workers", terms.workers),
                      enrolling.name);
  }
  Enrolment enrolment;
  for (const auto& [id, token] : tokens_) {
    if (!token.enrolled_by.empty() && token.until_unix_s <= now_unix_s) {
      enrolment.ended.push_back(id);
    }
  }
  for (const std::string& id : enrolment.ended) {
    tokens_.erase(id);
  }
  LM_RETURN_IF_ERROR(check_room());
  ++terms.enrolled;
  enrolment.token = {request.id, free_name(enrolling.name, request.host), {Role::worker}, request.hash, enrolling.name,
                     now_unix_s, now_unix_s + terms.worker_seconds};
  enrolment.token.enrolled_by = enrolling.id;
  enrolment.by = enrolling;
  enrolment.is_new = true;
  tokens_.emplace(request.id, enrolment.token);
  return enrolment;
}

std::string TokenRegistry::free_name(const std::string& of, const std::string& host) const {
  std::set<std::string_view> names;
  for (const auto& [id, token] : tokens_) {
    names.insert(token.name);
  }
  std::string name = fmt::format("{}/{}", of, host.empty() ? "1" : host);
  for (std::size_t number = 2; names.contains(name); ++number) {
    name = host.empty() ? fmt::format("{}/{}", of, number) : fmt::format("{}/{}-{}", of, host, number);
  }
  return name;
}

std::vector<std::string> TokenRegistry::enrolled_by(std::string_view id) const {
  std::vector<std::string> ids;
  for (const auto& [each, token] : tokens_) {
    if (!id.empty() && token.enrolled_by == id) {
      ids.push_back(each);
    }
  }
  return ids;
}

Status TokenRegistry::remove(std::string_view id) {
  const auto at = tokens_.find(id);
  if (at == tokens_.end()) {
    return not_found("there is no token {}", printable(id));
  }
  tokens_.erase(at);
  return ok_status();
}

const TokenRecord* TokenRegistry::find(std::string_view id) const {
  const auto at = tokens_.find(id);
  return at == tokens_.end() ? nullptr : &at->second;
}

std::vector<TokenRecord> TokenRegistry::all() const {
  std::vector<TokenRecord> tokens;
  for (const auto& [id, token] : tokens_) {
    tokens.push_back(token);
  }
  return tokens;
}

}  // namespace lightmill

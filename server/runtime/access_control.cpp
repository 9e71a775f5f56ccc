#include "server/runtime/access_control.h"

#include "common/base/log.h"
#include "common/security/caller.h"
#include "common/security/certificate.h"
#include "common/security/tls_files.h"

namespace lightmill {
namespace {

constexpr std::string_view kHeader = "authorization";
constexpr std::string_view kBearer = "Bearer ";

}  // namespace

Result<Identity> AccessControl::identify(const Credentials& credentials) const {
  if (credentials.authorization) {
    return identify_bearer(*credentials.authorization);
  }
  if (!options_.authenticates) {
    return anonymous_identity();
  }
  if (!credentials.certificate.empty()) {
    LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> facts, read_certificates(credentials.certificate));
    return identity_of(facts.front(), now_unix_s());
  }
  return options_.accepts_certificates
             ? make_error(StatusCode::kUnauthenticated,
                          "this farm requires authentication, and got neither a certificate nor a token: give {} or {}",
                          kCertificateOption, kTokenFileOption)
             : make_error(StatusCode::kUnauthenticated, "this farm requires authentication, and got no token: give {}",
                          kTokenFileOption);
}

/// Identity of the token in the header. A token goes before a certificate, which a machine may have for all of its
/// users.
Result<Identity> AccessControl::identify_bearer(std::string_view header) const {
  if (!options_.accepts_tokens) {
    return make_error(StatusCode::kUnauthenticated,
                      "this farm takes no tokens, because its connections are not encrypted. Others may have read this "
                      "token: revoke it");
  }
  // The scheme's case does not matter (RFC 9110, 11.1).
  if (header.size() < kBearer.size() ||
      !std::ranges::equal(header.substr(0, kBearer.size()), kBearer, [](char a, char b) {
        return std::tolower(static_cast<unsigned char>(a)) == std::tolower(b);
      })) {
    return make_error(StatusCode::kUnauthenticated, "the header {} is not '{}TOKEN'", kHeader, kBearer);
  }
  const MutexLock lock(mutex_);
  return tokens_.identify(header.substr(kBearer.size()), now_unix_s());
}

Result<Call> AccessControl::admit(const Result<Identity>& caller, const std::string& peer, const Rpc& rpc,
                                  const CallSubject& about, std::optional<StreamKind> kind) const {
  Call call{caller.ok() ? *caller : Identity{}, rpc, peer};
  Status status = counts_as_request(rpc) ? take_request(call.caller, peer) : ok_status();
  if (status.ok()) {
    status = caller.ok() ? check_call(*caller, rpc) : caller.status();
  }
  if (status.ok() && kind) {  // only after the check, so that unknown callers take no slots
    Result<std::shared_ptr<StreamSlot>> slot = slots_.take(*kind, holder_of(call.caller, peer));
    status = slot.status();
    call.slot = std::move(slot).value_or(nullptr);
  }
  if (!status.ok()) {
    on_refused_(call, about, status);
    return status;
  }
  return call;
}

Status AccessControl::take_request(const Identity& caller, const std::string& peer) const {
  const MutexLock lock(mutex_);
  return limits_.take_request(caller_key(caller, peer), clock_.now());
}

Status AccessControl::check_priority(const Identity& caller, std::int32_t priority) const {
  return priority <= options_.user_priority || caller.roles.has_any({Role::operate, Role::admin})
             ? ok_status()
             : make_error(
                   StatusCode::kPermissionDenied,
                   "priority {} is above {}, the highest that a user may give (--user-priority): ask an operator",
                   priority, options_.user_priority);
}

void AccessControl::charge_entries(const Call& call, std::size_t entries) const {
  const MutexLock lock(mutex_);
  limits_.charge_entries(caller_key(call.caller, call.peer), entries, clock_.now());
}

std::optional<SuppressedRefusals> AccessControl::may_record_refusal(const Call& call, const CallSubject& about,
                                                                    const Status& status) const {
  const MutexLock lock(mutex_);
  return refusals_.take(call, about, status, clock_.now());
}

std::optional<SuppressedRefusals> AccessControl::may_record_refusal(const Identity& caller) const {
  const MutexLock lock(mutex_);
  return refusals_.take(caller, clock_.now());
}

Status AccessControl::check_still_holds(const Identity& identity) const {
  if (identity.proof == Proof::token) {
    const MutexLock lock(mutex_);
    return tokens_.check_still_holds(identity, now_unix_s());
  }
  return lightmill::check_still_holds(identity, now_unix_s());
}

Status AccessControl::add_token(const TokenRecord& token) {
  const MutexLock lock(mutex_);
  return tokens_.add(token, now_unix_s());
}

Result<Enrolment> AccessControl::enrol(const Identity& by, const EnrolmentRequest& request) {
  const MutexLock lock(mutex_);
  return tokens_.enrol(by, request, now_unix_s());
}

std::vector<std::string> AccessControl::enrolled_by(std::string_view id) const {
  const MutexLock lock(mutex_);
  return tokens_.enrolled_by(id);
}

Status AccessControl::remove_token(std::string_view id) {
  const MutexLock lock(mutex_);
  return tokens_.remove(id);
}

std::optional<TokenRecord> AccessControl::find_token(std::string_view id) const {
  const MutexLock lock(mutex_);
  const TokenRecord* const token = tokens_.find(id);
  return token == nullptr ? std::nullopt : std::optional(*token);
}

std::vector<TokenRecord> AccessControl::tokens() const {
  const MutexLock lock(mutex_);
  return tokens_.all();
}

}  // namespace lightmill

// Access control: finds the identity behind a call's credentials, and checks if its roles and limits allow the call.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "server/access/call_limits.h"
#include "server/access/refusal_log.h"
#include "server/access/rights.h"
#include "server/access/token_registry.h"
#include "server/runtime/stream_slots.h"

namespace lightmill {

/// Authentication of callers, and their limits.
struct AccessOptions {
  bool authenticates = false;  ///< callers must authenticate; otherwise a caller without credentials may do everything
  bool accepts_certificates = false;  ///< an authority signs client certificates
  CallLimitOptions calls;
  std::int32_t user_priority = 10;  ///< the highest priority that a caller who may not operate the farm gives a job
  bool accepts_tokens = true;       ///< false if the connection is not encrypted, so that others could read tokens
};

/// Credentials of a call.
struct Credentials {
  std::optional<std::string> authorization;  ///< the header of that name, with a token
  std::string certificate;                   ///< PEM of a certificate that an authority of the farm signed; empty: none
  std::string peer;                          ///< ADDRESS:PORT
};

/// Thread-safe.
class AccessControl {
 public:
  AccessControl(const AccessOptions& options, std::vector<TokenRecord> tokens, const Clock& clock)
      : options_(options),
        clock_(clock),
        slots_(options.calls, clock),
        tokens_(std::move(tokens)),
        limits_(options.calls) {}

  /// Called with each refusal of admit. Set it before the server starts.
  void set_on_refused(std::function<void(const Call&, const CallSubject&, const Status&)> on_refused) {
    on_refused_ = std::move(on_refused);
  }

  /// Called with the identity of a gRPC connection. Set it before the server starts.
  void set_on_identified(std::function<Status(const std::string& peer, const Identity&)> on_identified) {
    on_identified_ = std::move(on_identified);
  }

  /// Called with each message over gRPC that was used or thrown away. Set it before the server starts.
  void set_on_taken(
      std::function<void(const std::string& peer, std::uint64_t bytes, std::uint64_t overhead)> on_taken) {
    on_taken_ = std::move(on_taken);
  }

  /// UNAUTHENTICATED.
  Result<Identity> identify(const Credentials& credentials) const;
  /// First step of every handler, with the result of identify. `about` is what the call names, for the action log.
  /// Errors: UNAUTHENTICATED, PERMISSION_DENIED, RESOURCE_EXHAUSTED.
  Result<Call> admit(const Result<Identity>& caller, const std::string& peer, const Rpc& rpc,
                     const CallSubject& about = {}) const {
    return admit(caller, peer, rpc, about, stream_kind(rpc));
  }
  /// Like admit, for a page that opens. It needs the right to WatchJob.
  Result<Call> admit_page(const Result<Identity>& caller, const std::string& peer) const {
    return admit(caller, peer, kWatchJob, {}, StreamKind::page);
  }
  /// Like ConnectionLimiter::set_caller, for a gRPC connection. RESOURCE_EXHAUSTED.
  Status set_caller(const std::string& peer, const Identity& caller) const { return on_identified_(peer, caller); }
  /// Like Listener::taken, for a gRPC connection.
  void taken(const std::string& peer, std::uint64_t bytes, std::uint64_t overhead) const {
    on_taken_(peer, bytes, overhead);
  }
  /// Counts one request against the caller's limits. RESOURCE_EXHAUSTED.
  Status take_request(const Identity& caller, const std::string& peer) const;
  /// PERMISSION_DENIED if the caller may not give a job this priority.
  Status check_priority(const Identity& caller, std::int32_t priority) const;
  std::int32_t user_priority() const { return options_.user_priority; }
  /// Like CallLimits::charge_entries.
  void charge_entries(const Call& call, std::size_t entries) const;
  /// Whether an admitted identity is still valid, while its stream lasts.
  Status check_still_holds(const Identity& identity) const;
  bool authenticates() const { return options_.authenticates; }

  // Like RefusalLog::take.
  std::optional<SuppressedRefusals> may_record_refusal(const Call& call, const CallSubject& about,
                                                       const Status& status) const;
  std::optional<SuppressedRefusals> may_record_refusal(const Identity& caller) const;

  // These change the known tokens at once. The caller stores them. Errors as for TokenRegistry.
  Status add_token(const TokenRecord& token);
  Result<Enrolment> enrol(const Identity& by, const EnrolmentRequest& request);
  std::vector<std::string> enrolled_by(std::string_view id) const;
  Status remove_token(std::string_view id);
  std::optional<TokenRecord> find_token(std::string_view id) const;
  std::vector<TokenRecord> tokens() const;

 private:
  Result<Call> admit(const Result<Identity>& caller, const std::string& peer, const Rpc& rpc, const CallSubject& about,
                     std::optional<StreamKind> kind) const;
  Result<Identity> identify_bearer(std::string_view header) const;
  std::int64_t now_unix_s() const { return clock_.unix_milliseconds() / 1000; }

  const AccessOptions options_;
  const Clock& clock_;
  mutable StreamSlots slots_;
  mutable Mutex mutex_;
  TokenRegistry tokens_ LM_GUARDED_BY(mutex_);
  mutable CallLimits limits_ LM_GUARDED_BY(mutex_);
  mutable RefusalLog refusals_ LM_GUARDED_BY(mutex_);
  std::function<Status(const std::string&, const Identity&)> on_identified_ = [](const auto&...) {
    return ok_status();
  };
  std::function<void(const std::string&, std::uint64_t, std::uint64_t)> on_taken_ = [](const auto&...) {};
  std::function<void(const Call&, const CallSubject&, const Status&)> on_refused_ = [](const auto&...) {};
};

}  // namespace lightmill

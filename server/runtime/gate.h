// Gate: makes an identity of a call's credentials, and checks whether its roles and limits allow the call.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "server/access/gate_options.h"
#include "server/access/refusal_book.h"
#include "server/access/rights.h"
#include "server/access/token_book.h"
#include "server/runtime/stream_places.h"

namespace lightmill {

/// Credentials of a call.
struct Shown {
  std::optional<std::string> authorization;  ///< the header of that name, with a token
  std::string certificate;                   ///< PEM of a certificate that an authority of the farm signed; empty: none
  std::string peer;                          ///< ADDRESS:PORT
};

/// Thread-safe.
class Gate {
 public:
  Gate(const GateOptions& options, std::vector<TokenRecord> tokens, const Clock& clock)
      : options_(options),
        clock_(clock),
        places_(options.calls, clock),
        book_(std::move(tokens)),
        limits_(options.calls) {}

  /// Called with each refusal of admit. Set it before the server starts.
  void set_on_refused(std::function<void(const Call&, const About&, const Status&)> on_refused) {
    on_refused_ = std::move(on_refused);
  }

  /// Called with the identity of a gRPC connection. Set it before the server starts.
  void set_on_met(std::function<Status(const std::string& peer, const Identity&)> on_met) {
    on_met_ = std::move(on_met);
  }

  /// UNAUTHENTICATED.
  Result<Identity> identify(const Shown& shown) const;
  /// First step of every handler, with the result of identify. `about` is what the call names, for the action log.
  /// Errors: UNAUTHENTICATED, PERMISSION_DENIED, RESOURCE_EXHAUSTED.
  Result<Call> admit(const Result<Identity>& caller, const std::string& peer, Rpc rpc, const About& about = {}) const {
    return admit(caller, peer, rpc, about, stream_kind(rpc));
  }
  /// Like admit, for a page that opens. It needs the right to WatchJob.
  Result<Call> admit_page(const Result<Identity>& caller, const std::string& peer) const {
    return admit(caller, peer, Rpc::watch_job, {}, StreamKind::page);
  }
  /// Like ConnectionBook::meet, for a gRPC connection. RESOURCE_EXHAUSTED.
  Status meet(const std::string& peer, const Identity& caller) const { return on_met_(peer, caller); }
  /// Counts one request against the caller's limits. RESOURCE_EXHAUSTED.
  Status take_request(const Identity& caller, const std::string& peer) const;
  /// Whether an admitted identity is still valid, while its stream lasts.
  Status check_still_holds(const Identity& identity) const;
  bool asks() const { return options_.asks; }

  // Like RefusalBook::take.
  std::optional<Unwritten> may_record_refusal(const Call& call, const About& about, const Status& status) const;
  std::optional<Unwritten> may_record_refusal(const Identity& caller) const;

  // These change the known tokens at once. The caller stores them. Errors as for TokenBook.
  Status add_token(const TokenRecord& token);
  Result<Enrolment> enrol(const Identity& by, const EnrolmentRequest& request);
  std::vector<std::string> enrolled_by(std::string_view id) const;
  Status remove_token(std::string_view id);
  std::optional<TokenRecord> find_token(std::string_view id) const;
  std::vector<TokenRecord> tokens() const;

 private:
  Result<Call> admit(const Result<Identity>& caller, const std::string& peer, Rpc rpc, const About& about,
                     std::optional<StreamKind> kind) const;
  Result<Identity> identify_bearer(std::string_view header) const;
  std::int64_t now_unix_s() const { return clock_.unix_milliseconds() / 1000; }

  const GateOptions options_;
  const Clock& clock_;
  mutable StreamPlaces places_;
  mutable Mutex mutex_;
  TokenBook book_ LM_GUARDED_BY(mutex_);
  mutable CallLimits limits_ LM_GUARDED_BY(mutex_);
  mutable RefusalBook refusals_ LM_GUARDED_BY(mutex_);
  std::function<Status(const std::string&, const Identity&)> on_met_ = [](const auto&...) { return ok_status(); };
  std::function<void(const Call&, const About&, const Status&)> on_refused_ = [](const auto&...) {};
};

}  // namespace lightmill

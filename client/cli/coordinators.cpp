#include "client/cli/coordinators.h"

#include <algorithm>
#include <optional>

#include "common/security/connection_problem.h"

namespace lightmill::cli {
namespace {

constexpr int kMaxMessageBytes = 64 << 20;  // a watcher may receive many tiles in one message

std::shared_ptr<grpc::ChannelCredentials> credentials_of(const TlsTexts& tls) {
  return tls.given() ? grpc::SslCredentials({tls.authority, tls.key, tls.certificate})
                     : grpc::InsecureChannelCredentials();
}

/// `quickly`: another coordinator can be asked if one is silent.
std::shared_ptr<grpc::Channel> make_channel(const std::string& address, const TlsTexts& tls, bool quickly) {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, 100);
  // Time limit of a connection attempt. A very busy machine takes seconds to answer.
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, quickly ? 3'000 : 10'000);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, 2000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, quickly ? 3'000 : 20'000);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, quickly ? 3'000 : 10'000);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // else a new channel gets the old connection
  return grpc::CreateCustomChannel(address, credentials_of(tls), arguments);
}

/// Whether the status comes from gRPC and not from a coordinator. Messages of coordinators begin so.
bool is_silence(const grpc::Status& status) {
  return (status.error_code() == grpc::StatusCode::UNAVAILABLE ||
          status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED) &&
         !status.error_message().starts_with("the coordinator ") && !status.error_message().starts_with("the farm ");
}

/// The status of an answer of the coordinator at `address`.
Status to_status(const grpc::Status& status, const std::string& address) {
  if (status.ok()) {
    return ok_status();
  }
  if (status.error_code() == grpc::StatusCode::UNIMPLEMENTED) {
    return unavailable(
        "the coordinator at {} has another version, or is another program: {}. Use its version of lightmill", address,
        status.error_message());
  }
  return make_error(static_cast<StatusCode>(status.error_code()), "{}", status.error_message());
}

}  // namespace

Coordinators::Coordinators(const std::string& addresses, CallerTexts caller)
    : all_(addresses), caller_(std::move(caller)) {
  for (std::size_t at = 0; at <= addresses.size();) {
    const std::size_t end = std::min(addresses.find(',', at), addresses.size());
    addresses_.push_back(addresses.substr(at, end - at));
    at = end + 1;
  }
  const MutexLock lock(mutex_);
  stubs_.resize(addresses_.size());
}

std::shared_ptr<const Stubs> Coordinators::connected_to(std::size_t index) {
  const MutexLock lock(mutex_);
  if (stubs_[index] == nullptr) {
    stubs_[index] = std::make_shared<Stubs>(make_channel(addresses_[index], caller_.tls, addresses_.size() > 1));
  }
  return stubs_[index];
}

void Coordinators::forget_if_silent(std::size_t index, const std::shared_ptr<const Stubs>& stubs,
                                    const grpc::Status& answer) {
  const MutexLock lock(mutex_);
  if (is_silence(answer) && stubs_[index] == stubs) {  // another thread may have a new one already
    stubs_[index] = nullptr;
  }
}

void Coordinators::show_token(grpc::ClientContext& context) const {
  if (!caller_.token.empty()) {
    context.AddMetadata("authorization", caller_.authorization());
  }
}

Status Coordinators::status_of(const grpc::Status& answer, std::size_t index) const {
  if (!is_silence(answer)) {
    return to_status(answer, all_);
  }
  const std::optional<std::string> problem = connection_problem(addresses_[index], caller_.tls);
  if (problem) {
    return failed_precondition("cannot reach the farm at {}: {}", addresses_[index], *problem);
  }
  return answer.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED
             ? unavailable("the farm at {} has not answered in time: the request may or may not have been executed",
                           all_)
             : unavailable("cannot reach the farm at {}: {}", all_, cause_of_silence(answer.error_message()));
}

}  // namespace lightmill::cli

#include "server/access/call_limits.h"

#include <cmath>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Looking through all callers for those that need no entry any more takes a millisecond.
constexpr Duration kSweepPause = std::chrono::seconds(1);

}  // namespace

std::string caller_key(const Identity& identity, std::string_view peer) {
  const std::string_view host = peer.substr(0, peer.rfind(':'));
  return identity.is_known()
             ? fmt::format("{}{} {}", identity.proof == Proof::token ? "token " : "", identity.name, host)
             : fmt::format("nobody {}", host);
}

bool counts_as_request(Rpc rpc) {
  return rpc != Rpc::upload_asset && rpc != Rpc::download_asset && rpc != Rpc::work;
}

bool counts_as_stream(Rpc rpc) {
  return rpc == Rpc::upload_asset || rpc == Rpc::download_asset || rpc == Rpc::watch_job || rpc == Rpc::get_film ||
         rpc == Rpc::stream_is_active;
}

std::pair<std::string, CallLimits::Caller*> CallLimits::caller_of(const std::string& caller, Time now) {
  if (const auto found = callers_.find(caller); found != callers_.end()) {
    return {caller, &found->second};
  }
  if (callers_.size() >= kMostCallers && now - swept_at_ >= kSweepPause) {
    swept_at_ = now;
    std::erase_if(callers_,
                  [now](auto& entry) { return entry.second.streams == 0 && entry.second.requests.is_full(now); });
  }
  if (callers_.size() >= kMostCallers) {
    return {"", &others_};
  }
  return {caller, &callers_.emplace(caller, Caller(options_)).first->second};
}

Status CallLimits::take_request(const std::string& caller, Time now) {
  Allowance& requests = caller_of(caller, now).second->requests;
  return requests.take(now)
             ? ok_status()
             : resource_exhausted(
                   "the farm takes {:g} requests a second of one caller (--caller-requests): try again in {:.0f} ms",
                   options_.requests_per_second, std::ceil(1000 * to_seconds(requests.wait(now))));
}

Result<std::string> CallLimits::open_stream(const std::string& caller, Time now) {
  const auto [place, entry] = caller_of(caller, now);
  if (streams_ >= options_.streams) {
    return resource_exhausted("the farm has all of its {} streams open (--streams): try again later", options_.streams);
  }
  if (entry->streams >= options_.streams_per_caller) {
    return resource_exhausted(
        "the farm takes {} streams at once of one caller (--caller-streams): try again when one has ended",
        options_.streams_per_caller);
  }
  ++entry->streams;
  ++streams_;
  return place;
}

void CallLimits::close_stream(const std::string& place) {
  Caller& caller = place.empty() ? others_ : callers_.at(place);
  LM_CHECK(caller.streams > 0 && streams_ > 0);
  --caller.streams;
  --streams_;
}

}  // namespace lightmill

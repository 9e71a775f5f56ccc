#include "client/cli/follow.h"

#include <algorithm>

#include "client/cli/progress.h"
#include "client/cli/units.h"

namespace lightmill::cli {
namespace {

constexpr Duration kFirstPause = std::chrono::milliseconds(200);
constexpr Duration kLongestPause = std::chrono::seconds(5);
constexpr Duration kTimeout = std::chrono::minutes(10);

/// Cancels the connection's calls at interruptions and children's deaths during its lifetime.
class CancelOnEvent {
 public:
  CancelOnEvent(Signals& signals, CoordinatorClient& connection) : signals_(signals) {
    signals_.on_event([&connection] { connection.cancel_calls(); });
  }
  ~CancelOnEvent() { signals_.on_event({}); }
  CancelOnEvent(const CancelOnEvent&) = delete;
  CancelOnEvent& operator=(const CancelOnEvent&) = delete;

 private:
  Signals& signals_;
};

/// Whether another attempt may succeed. Otherwise the answer is final.
bool may_recover(const Status& status) {
  return status.ok() || status.code() == StatusCode::kUnavailable || status.code() == StatusCode::kCancelled;
}

}  // namespace

Result<v1::Job> follow_job(Farm& farm, std::uint64_t id, bool tiles, Signals& signals, const Console& console,
                           const std::function<void(const v1::WatchJobResponse&)>& changed) {
  const CancelOnEvent cancel(signals, *farm.connection);
  v1::Job job;
  std::string waits_for;
  std::optional<std::chrono::steady_clock::time_point> lost_since;
  Duration pause = kFirstPause;
  const auto stop = [&] { return signals.interrupted() || (farm.local_farm && !farm.local_farm->health().ok()); };
  for (;;) {
    const Status status = farm.connection->watch(id, tiles, stop, [&](const v1::WatchJobResponse& response) {
      if (lost_since) {
        console.notice("connected again");
        lost_since.reset();
        pause = kFirstPause;
      }
      if (response.has_job()) {
        job = response.job();
        if (const std::string reason = has_ended(job.state()) ? "" : job.reason(); reason != waits_for) {
          waits_for = reason;
          if (!reason.empty() && !farm.local_farm) {  // a local farm's workers are still starting
            console.notice(fmt::format("job {}: {}", id, reason));
          }
        }
      }
      changed(response);
    });
    if (has_ended(job.state())) {
      return job;
    }
    if (signals.interrupted()) {
      return cancelled("interrupted");
    }
    if (farm.local_farm) {
      LM_RETURN_IF_ERROR(farm.local_farm->health());
    }
    if (!may_recover(status)) {
      return status;
    }
    const auto now = std::chrono::steady_clock::now();
    if (!lost_since) {
      lost_since = now;
      console.notice(fmt::format("lost the connection to {}, retrying …", farm.connection->address()));
    } else if (now - *lost_since > kTimeout) {
      return unavailable("the farm at {} has not answered for {}", farm.connection->address(),
                         human_seconds(to_seconds(kTimeout)));
    }
    signals.sleep(pause);
    pause = std::min(2 * pause, kLongestPause);
  }
}

}  // namespace lightmill::cli

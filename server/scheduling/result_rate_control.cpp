#include "server/scheduling/result_rate_control.h"

#include <algorithm>

namespace lightmill {
namespace {

constexpr Duration kInterval = std::chrono::seconds(2);  ///< least time of a measurement
/// A longer measurement, in which no worker reported, says nothing about what the coordinator can take.
constexpr Duration kLongestInterval = std::chrono::seconds(10);
constexpr Duration kReportLifetime = std::chrono::seconds(30);
/// Longer waits mean too many results. Shorter waits allow more.
constexpr Duration kLongWait = std::chrono::seconds(3), kShortWait = std::chrono::seconds(1);
constexpr double kMore = 1.2, kMoreWhileIdle = 2;
constexpr double kPartOfArrivals = 0.9;  ///< the rest is for waiting results
constexpr double kMaxCut = 0.25;
constexpr double kMinPart = 1.0 / 64;  ///< of `most`
constexpr Duration kLongestAway = std::chrono::seconds(30);
constexpr Duration kAfterStandstill = std::chrono::seconds(10);

}  // namespace

Duration median_of(std::vector<Duration>& waits) {
  const auto middle = waits.begin() + static_cast<std::ptrdiff_t>(waits.size() / 2);
  std::ranges::nth_element(waits, middle);
  return *middle;
}

ResultRateControl::ResultRateControl(double most, Time now) : most_(most), rate_(most), begin_(now), changed_(now) {}

void ResultRateControl::add_result(double bytes, Time now) {
  if (now >= begin_) {
    bytes_ += bytes;
  }
}

bool ResultRateControl::is_due(Time now) const {
  return now >= begin_ + kInterval;
}

Time ResultRateControl::window_start(Time now) const {
  return std::max(changed_, now - kReportLifetime);
}

bool ResultRateControl::update(std::vector<Duration>& waits, Time now) {
  const Duration elapsed = now - begin_;
  const double came = bytes_ / to_seconds(elapsed);
  const Duration unit = longest_unit_;
  begin_ = now;
  bytes_ = 0;
  longest_unit_ = Duration::zero();
  if (elapsed > kLongestInterval) {
    return false;
  }
  const double before = rate_;
  Duration wait{};
  if (!waits.empty()) {
    wait = median_of(waits);
    if (wait > kLongWait && came > 0) {
      // If the rate is already lower, the excess was leased before.
      const double cut = std::max({kPartOfArrivals * came, kMaxCut * rate_, kMinPart * most_});
      rate_ = std::min(rate_, cut);
    } else if (wait < kShortWait) {
      rate_ = std::min(kMore * rate_, most_);
    }
  } else if (came == 0) {
    rate_ = std::min(kMoreWhileIdle * rate_, most_);
  }
  if (rate_ == before) {
    return false;
  }
  // Workers still render the unit at work and the one ahead, of the earlier length. Their results wait as long as
  // others.
  ignore_until(now + std::min(2 * unit + wait, kLongestAway));
  return true;
}

void ResultRateControl::note_stall(Time now) {
  ignore_until(now + kAfterStandstill);
}

void ResultRateControl::ignore_until(Time until) {
  begin_ = changed_ = until;
  bytes_ = 0;
}

}  // namespace lightmill

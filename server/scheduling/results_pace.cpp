#include "server/scheduling/results_pace.h"

#include <algorithm>

namespace lightmill {
namespace {

constexpr Duration kLook = std::chrono::seconds(2);  ///< so long waits and bytes are added up
/// Results that wait longer on average are too many; while they wait less, there may be more of them.
constexpr double kLongWait = 3, kShortWait = 1;
/// As which any longer one counts, lest a few bad lines, or liars, slow the others down.
constexpr double kMostWait = 10;
constexpr double kMore = 1.2;
constexpr double kLeastCut = 0.7, kMostCut = 0.25;
constexpr double kLeastPart = 1.0 / 64;  ///< of the most

}  // namespace

ResultsPace::ResultsPace(double most, Time now) : most_(most), rate_(most), begin_(now) {}

void ResultsPace::came(double bytes, Time now) {
  if (now >= begin_) {
    bytes_ += bytes;
  }
}

bool ResultsPace::waited(Duration wait, Duration unit, Time now) {
  if (now < begin_) {
    return false;
  }
  wait_seconds_ += std::min(to_seconds(wait), kMostWait);
  ++waits_;
  if (now - begin_ < kLook) {
    return false;
  }
  const double mean = wait_seconds_ / waits_;
  const double came = bytes_ / to_seconds(now - begin_);
  const double before = rate_;
  if (mean > kLongWait) {
    rate_ = std::max(std::clamp(came, kMostCut * rate_, kLeastCut * rate_), kLeastPart * most_);
  } else if (mean < kShortWait) {
    rate_ = std::min(kMore * rate_, most_);
  }
  // What was given out before is rendered, and the one ahead of it.
  begin_ = rate_ == before ? now : now + 2 * unit + from_seconds(mean);
  bytes_ = wait_seconds_ = 0;
  waits_ = 0;
  return rate_ != before;
}

}  // namespace lightmill

#include "common/planner/pilot_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "common/base/check.h"

namespace lightmill {
namespace {

/// Measured for eight rays at once on two boxes: a shadow ray needs not find the nearest.
constexpr double kShadowRayCost = 0.55;
constexpr std::size_t kTrimmedOneIn = 1000;

/// How many times less work than the first method, on the batch where that is less.
double gain_over_first(std::span<const PilotMeasure> measures, std::size_t method) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t batch : {0, 1}) {
    const double own = measures[method].inefficiency(batch), first = measures[0].inefficiency(batch);
    // What has neither noise nor cost cannot be left, nor gained by.
    least = std::min(least, own > 0 ? first / own : first > 0 ? least : 0);
  }
  return least;
}

}  // namespace

double cost_of(const CountedWork& work) {
  return static_cast<double>(work.closest_hit_rays) + kShadowRayCost * static_cast<double>(work.shadow_rays);
}

PilotChoice choose(std::span<const std::string> methods, std::span<const PilotMeasure> measures) {
  LM_CHECK(!measures.empty() && methods.size() == measures.size());
  PilotChoice result;
  double best = kClearGain;
  for (std::size_t i = 1; i < measures.size(); ++i) {
    if (const double gain = gain_over_first(measures, i); gain > best) {
      best = gain;
      result.choice = i;
    }
  }
  for (std::size_t i = 1; i < measures.size(); ++i) {
    result.reasons.push_back(
        fmt::format("to the same error {} needs {:.2g} or {:.2g} times the work of {}, by two pilots", methods[0],
                    measures[0].inefficiency(0) / measures[i].inefficiency(0),
                    measures[0].inefficiency(1) / measures[i].inefficiency(1), methods[i]));
  }
  return result;
}

double trimmed_mean(std::span<double> values) {
  if (values.empty()) {
    return 0;
  }
  const std::size_t dropped =
      values.size() == 1 ? 0 : std::max<std::size_t>((values.size() + kTrimmedOneIn - 1) / kTrimmedOneIn, 1);
  const std::size_t kept = values.size() - dropped;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept) - 1, values.end());
  std::sort(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept));  // one order of addition
  return std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept), 0.0) /
         static_cast<double>(kept);
}

}  // namespace lightmill

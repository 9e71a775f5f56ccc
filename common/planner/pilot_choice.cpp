#include "common/planner/pilot_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/base/check.h"
#include "common/base/number_text.h"

namespace lightmill {
namespace {

constexpr std::size_t kTrimmedOneIn = 1000;

/// Gain: work of the simplest method over work of the other one. The smaller gain of the two batches.
double gain(const PilotMeasure& simplest, const PilotMeasure& other) {
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t batch : {0, 1}) {
    const double own = other.inefficiency(batch), reference = simplest.inefficiency(batch);
    // If the simplest method has no noise or no cost, there is no gain.
    least = std::min(least, own > 0 ? reference / own : reference > 0 ? least : 0);
  }
  return least;
}

/// "for the same error, path needs 3.1 to 3.4 times the work of caustic".
std::string needs(const std::string& method, double least, double most, const std::string& other) {
  const std::string from = significant(least, 2), to = significant(most, 2);
  return fmt::format("for the same error, {} needs {} times the work of {}", method,
                     from == to ? to : fmt::format("{} to {}", from, to), other);
}

std::string compare(const std::string& simplest, const PilotMeasure& its, const std::string& other,
                    const PilotMeasure& others) {
  const auto silent = [](const PilotMeasure& of) {
    return static_cast<int>(of.inefficiency(0) == 0) + static_cast<int>(of.inefficiency(1) == 0);
  };
  for (const auto& [name, batches] : {std::pair(simplest, silent(its)), std::pair(other, silent(others))}) {
    if (batches > 0) {
      return fmt::format("{} had no noise in {}", name, batches == 2 ? "two pilots" : "one of two pilots");
    }
  }
  const std::array ratios{its.inefficiency(0) / others.inefficiency(0), its.inefficiency(1) / others.inefficiency(1)};
  const auto [least, most] = std::ranges::minmax(ratios);
  if (most <= 1) {
    return needs(other, 1 / most, 1 / least, simplest);
  }
  // Explains why a small gain, or a gain on one batch, does not decide.
  return needs(simplest, least, most, other) +
         (least > kClearGain
              ? ""
              : fmt::format("; a gain must be above {} in both pilots, and {} is simpler", kClearGain, simplest));
}

bool misses_light(const PilotMeasure& one, const PilotMeasure& other) {
  constexpr double kDeviations = 3;
  return std::ranges::all_of(std::array<std::size_t, 2>{0, 1}, [&](std::size_t batch) {
    const double less = other.light[batch] - one.light[batch];
    const double deviation = std::sqrt(one.light_variance[batch] + other.light_variance[batch]);
    return less > kMissedLight * other.light[batch] && less > kDeviations * deviation;
  });
}

}  // namespace

PilotChoice choose(std::span<const std::string> methods, std::span<const PilotMeasure> measures) {
  LM_CHECK(!measures.empty() && methods.size() == measures.size());
  PilotChoice result;
  std::vector<std::size_t> complete;
  for (std::size_t i = 0; i < measures.size(); ++i) {
    const auto richer =
        std::ranges::find_if(measures, [&](const PilotMeasure& m) { return misses_light(measures[i], m); });
    if (richer == measures.end()) {
      complete.push_back(i);
      continue;
    }
    const auto percent = [&](std::size_t batch) { return 100 * (1 - measures[i].light[batch] / richer->light[batch]); };
    result.reasons.push_back(
        fmt::format("{} missed {}% and {}% of the light that {} found in two pilots: its paths hit it too rarely",
                    methods[i], significant(percent(0), 2), significant(percent(1), 2),
                    methods[static_cast<std::size_t>(richer - measures.begin())]));
  }
  // The method with the most light on a batch misses nothing, so there is at least one.
  const std::size_t simplest = complete.front();
  result.choice = simplest;
  double best = kClearGain;
  for (const std::size_t i : std::span(complete).subspan(1)) {
    if (const double by = gain(measures[simplest], measures[i]); by > best) {
      best = by;
      result.choice = i;
    }
    result.reasons.push_back(compare(methods[simplest], measures[simplest], methods[i], measures[i]));
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
  std::sort(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept));  // fixes the order of addition
  return std::accumulate(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(kept), 0.0) /
         static_cast<double>(kept);
}

}  // namespace lightmill

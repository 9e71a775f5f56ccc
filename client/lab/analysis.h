// Analysis of results: curves, times to an error, speed-ups, the regret of `auto`. Pure.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/lab/results.h"

namespace lightmill::lab {

/// Median and range over several seeds.
struct Spread {
  double median = 0, least = 0, most = 0;
};

/// `values` is not empty. For an even count the median is the geometric mean of the middle two, because values are
/// positive and drawn on log axes. If one of the two is not positive, it is the plain mean.
Spread spread_of(std::vector<double> values);

/// One level of a method on a scene.
struct CurvePoint {
  double samples = 0;
  Spread seconds;  ///< seconds of threads
  Spread error;    ///< by the requested metric
  std::size_t seeds = 0;
};

using Metric = std::function<double(const LabResult&)>;

/// The levels that have results, in order.
std::vector<CurvePoint> curve_of(const std::vector<LabResult>& results, const std::string& scene,
                                 const std::string& method, const Metric& metric);

/// A time, and whether it is extrapolated. Beyond the curve's ends, errors are assumed to fall as 1/time.
struct TimeToError {
  double seconds = 0;
  bool extrapolated = false;
};

/// The time at which the medians of a curve first reach `error`, on the straight lines of a log-log chart. Empty for a
/// curve without positive values. Extrapolates beyond the last point only up to `reach` times the least error.
std::optional<TimeToError> time_to_error(const std::vector<CurvePoint>& curve, double error, double reach = 1);

/// The exponent p of error ∝ samples^p, by least squares on logarithms of the medians. Empty for fewer than two points.
std::optional<double> slope_of(const std::vector<CurvePoint>& curve);

/// The time of `baseline` over the time of a curve to the error that both reach (the greater of their last errors).
struct SpeedUp {
  double factor = 1, at_error = 0;
  bool extrapolated = false;
};
std::optional<SpeedUp> speed_up(const std::vector<CurvePoint>& curve, const std::vector<CurvePoint>& baseline);

/// The cost of the automatic choice: its time over that of the best other method, at the last error of the choice.
/// Methods that end above twice that error do not count. Empty if none is left.
struct Regret {
  double factor = 1;
  std::string best;
};
std::optional<Regret> regret_of(const std::vector<LabResult>& results, const std::string& scene,
                                const std::string& chooser, const std::vector<std::string>& methods,
                                const Metric& metric);

/// Geometric mean, least and most of the given factors.
struct Summary {
  double mean = 1, least = 1, most = 1;
  std::size_t count = 0;
};
Summary summarise(const std::vector<double>& factors);

}  // namespace lightmill::lab

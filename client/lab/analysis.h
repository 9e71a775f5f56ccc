// From results to what they say: curves, times to an error, speed-ups, the chooser's regret. Pure.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/lab/results.h"

namespace lightmill::lab {

/// Of several seeds.
struct Spread {
  double median = 0, least = 0, most = 0;
};

/// `values` is not empty; of an even number the median is the geometric mean of the middle two, as the values are
/// positive and drawn on log axes (the plain mean where one is not).
Spread spread_of(std::vector<double> values);

/// One level of a method on a scene.
struct CurvePoint {
  double samples = 0;
  Spread seconds;  ///< of threads
  Spread error;    ///< by the metric asked for
  std::size_t seeds = 0;
};

using Metric = std::function<double(const LabResult&)>;

/// The levels that have results, in their order.
std::vector<CurvePoint> curve_of(const std::vector<LabResult>& results, const std::string& scene,
                                 const std::string& method, const Metric& metric);

/// A time, and whether it lies beyond the curve's ends, where errors are taken to fall as 1/time.
struct TimeToError {
  double seconds = 0;
  bool extrapolated = false;
};

/// When the medians of a curve first come down to `error`: on the straight lines of a log-log chart. Empty for a curve
/// without positive values. Beyond its last point only up to `reach` times the least error.
std::optional<TimeToError> time_to_error(const std::vector<CurvePoint>& curve, double error, double reach = 1);

/// The exponent p of error ∝ samples^p, by least squares on logarithms of the medians; empty for fewer than two points.
std::optional<double> slope_of(const std::vector<CurvePoint>& curve);

/// How many times sooner `curve` is at the error that both reach (the greater of their last) than `baseline`.
struct SpeedUp {
  double factor = 1, at_error = 0;
  bool extrapolated = false;
};
std::optional<SpeedUp> speed_up(const std::vector<CurvePoint>& curve, const std::vector<CurvePoint>& baseline);

/// What the chooser's choice cost: its time over that of the best other method, at the chooser's last error. Methods
/// that end above twice that error are no choice. Empty if there is none.
struct Regret {
  double factor = 1;
  std::string best;
};
std::optional<Regret> regret_of(const std::vector<LabResult>& results, const std::string& scene,
                                const std::string& chooser, const std::vector<std::string>& methods,
                                const Metric& metric);

/// Geometric mean and least or most of what is there.
struct Summary {
  double mean = 1, least = 1, most = 1;
  std::size_t count = 0;
};
Summary summarise(const std::vector<double>& factors);

}  // namespace lightmill::lab

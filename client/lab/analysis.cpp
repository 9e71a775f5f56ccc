#include "client/lab/analysis.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace lightmill::lab {
namespace {

bool drawable(const CurvePoint& point) {
  return point.seconds.median > 0 && point.error.median > 0 && std::isfinite(point.error.median);
}

std::vector<CurvePoint> drawable_part(const std::vector<CurvePoint>& curve) {
  std::vector<CurvePoint> part;
  std::ranges::copy_if(curve, std::back_inserter(part), drawable);
  return part;
}

}  // namespace

Spread spread_of(std::vector<double> values) {
  std::ranges::sort(values);
  const double low = values[(values.size() - 1) / 2], high = values[values.size() / 2];
  const bool positive = low > 0 && std::isfinite(high);
  return {low == high ? low : positive ? std::sqrt(low * high) : (low + high) / 2, values.front(), values.back()};
}

std::vector<CurvePoint> curve_of(const std::vector<LabResult>& results, const std::string& scene,
                                 const std::string& method, const Metric& metric) {
  struct Level {
    std::vector<double> samples, seconds, errors;
  };
  std::map<std::size_t, Level> levels;
  for (const LabResult& result : results) {
    if (result.scene == scene && result.method == method) {
      Level& level = levels[result.level];
      level.samples.push_back(static_cast<double>(result.samples));
      level.seconds.push_back(result.thread_seconds);
      level.errors.push_back(metric(result));
    }
  }
  std::vector<CurvePoint> curve;
  for (auto& [number, level] : levels) {
    const std::size_t seeds = level.errors.size();
    curve.push_back({spread_of(std::move(level.samples)).median, spread_of(std::move(level.seconds)),
                     spread_of(std::move(level.errors)), seeds});
  }
  return curve;
}

std::optional<TimeToError> time_to_error(const std::vector<CurvePoint>& whole, double error, double reach) {
  const std::vector<CurvePoint> curve = drawable_part(whole);
  if (curve.empty()) {
    return std::nullopt;
  }
  const CurvePoint& first = curve.front();
  if (first.error.median <= error) {
    return TimeToError{first.seconds.median * first.error.median / error, first.error.median < error};
  }
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const CurvePoint& before = curve[i - 1];
    const CurvePoint& after = curve[i];
    if (after.error.median <= error) {
      const double part = std::log(before.error.median / error) / std::log(before.error.median / after.error.median);
      return TimeToError{before.seconds.median * std::pow(after.seconds.median / before.seconds.median, part), false};
    }
  }
  const auto best = std::ranges::min_element(curve, {}, [](const CurvePoint& point) { return point.error.median; });
  if (best->error.median > reach * error) {
    return std::nullopt;
  }
  return TimeToError{best->seconds.median * best->error.median / error, true};
}

std::optional<double> slope_of(const std::vector<CurvePoint>& whole) {
  const std::vector<CurvePoint> curve = drawable_part(whole);
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
  for (const CurvePoint& point : curve) {
    mean_x += std::log(point.samples) / static_cast<double>(curve.size());
    mean_y += std::log(point.error.median) / static_cast<double>(curve.size());
  }
  for (const CurvePoint& point : curve) {
    const double x = std::log(point.samples) - mean_x;
    xx += x * x;
    xy += x * (std::log(point.error.median) - mean_y);
  }
  return curve.size() < 2 || xx == 0 ? std::nullopt : std::optional(xy / xx);
}

std::optional<SpeedUp> speed_up(const std::vector<CurvePoint>& curve, const std::vector<CurvePoint>& baseline) {
  const auto least = [](const std::vector<CurvePoint>& whole) {
    double error = std::numeric_limits<double>::infinity();
    for (const CurvePoint& point : drawable_part(whole)) {
      error = std::min(error, point.error.median);
    }
    return error;
  };
  const double error = std::max(least(curve), least(baseline));
  const std::optional<TimeToError> own = time_to_error(curve, error), other = time_to_error(baseline, error);
  if (!own || !other || !std::isfinite(error)) {
    return std::nullopt;
  }
  return SpeedUp{other->seconds / own->seconds, error, own->extrapolated || other->extrapolated};
}

std::optional<Regret> regret_of(const std::vector<LabResult>& results, const std::string& scene,
                                const std::string& chooser, const std::vector<std::string>& methods,
                                const Metric& metric) {
  const std::vector<CurvePoint> own = drawable_part(curve_of(results, scene, chooser, metric));
  if (own.empty()) {
    return std::nullopt;
  }
  const double error = own.back().error.median;
  std::optional<Regret> regret;
  for (const std::string& method : methods) {
    if (method == chooser) {
      continue;
    }
    const std::optional<TimeToError> other = time_to_error(curve_of(results, scene, method, metric), error, 2);
    const double factor = other ? own.back().seconds.median / other->seconds : 0;
    if (other && (!regret || factor > regret->factor)) {
      regret = Regret{factor, method};
    }
  }
  return regret;
}

Summary summarise(const std::vector<double>& factors) {
  Summary summary;
  if (factors.empty()) {
    return summary;
  }
  double logs = 0;
  for (const double factor : factors) {
    logs += std::log(factor);
  }
  summary.mean = std::exp(logs / static_cast<double>(factors.size()));
  summary.least = std::ranges::min(factors);
  summary.most = std::ranges::max(factors);
  summary.count = factors.size();
  return summary;
}

}  // namespace lightmill::lab

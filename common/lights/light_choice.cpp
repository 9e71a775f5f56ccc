#include "common/lights/light_choice.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/sampling/discrete.h"

namespace lightmill {
namespace {

/// With few lights, each has at least this share of the mean probability, because the strongest need not be the
/// nearest.
constexpr double kLeastShare = 1.0 / 64;
/// Range of the bounded lights' share. The flux of distant lights grows with the scene.
constexpr double kLeastBounded = 0.25, kMostBounded = 0.75;
/// Scales `bounded` to its share beside `distant`.
void balance(std::span<double> bounded, std::span<const double> distant) {
  const double near = sum_of(bounded), far = sum_of(distant);
  if (!(near > 0) || !(far > 0)) {
    return;
  }
  const double share = std::clamp(near / (near + far), kLeastBounded, kMostBounded);
  for (double& w : bounded) {
    w *= share / (1 - share) * far / near;
  }
}

}  // namespace

LightChoice::LightChoice(std::span<const LightBounds> bounded, std::span<const double> distant_powers)
    : count_(bounded.size() + distant_powers.size()), bounded_(bounded.size()) {
  if (trivial()) {
    return;
  }
  const bool many = count_ > kMostLightsByPower && !bounded.empty();
  double total = 0;
  std::vector<double> weights;
  for (const LightBounds& light : bounded) {
    weights.push_back(light.power);
    total += light.power;
  }
  if (many) {
    tree_.emplace(bounded);
    weights = {total};
  }
  balance(weights, distant_powers);
  weights.insert(weights.end(), distant_powers.begin(), distant_powers.end());
  const double least = sum_of(weights) / static_cast<double>(weights.size()) * kLeastShare;
  for (double& w : weights) {
    w = std::max(w, least);
  }
  by_power_ = DiscreteDistribution(weights);
  float sum = 0;
  for (std::size_t i = 0; i < weights.size(); ++i) {
    pmf_.push_back(by_power_.pmf(i));
    first_.push_back(sum);
    sum += pmf_.back();  // exact: multiples of 2^-24
  }
}

LightChoice::Choice8 LightChoice::sample(const V8& p, Pair8 u) const {
  if (trivial()) {
    return {U8(0u), F8(1.0f)};
  }
  const DiscreteDistribution::Choice8 entry = by_power_.sample(u.u);
  if (!tree_) {
    return {entry.index, entry.pmf};
  }
  const M8 in_tree = entry.index == U8(0u);
  const F8 rest = (u.u - gather(first_.data(), entry.index, M8(true))) / entry.pmf;
  const LightBvh::Choice8 chosen = tree_->sample(p, rest, u.v);
  const U8 distant = entry.index + U8(static_cast<std::uint32_t>(bounded_ - 1));
  return {select(in_tree, chosen.light, distant), select(in_tree, entry.pmf * chosen.pmf, entry.pmf)};
}

F8 LightChoice::pmf(const V8& p, U8 light, M8 lanes) const {
  if (trivial()) {
    return masked(lanes, F8(1.0f));
  }
  if (!tree_) {
    return gather(pmf_.data(), light, lanes);
  }
  const U8 first_distant(static_cast<std::uint32_t>(bounded_));
  const M8 in_tree = lanes & signed_less(light, first_distant);
  const F8 of_distant = gather(pmf_.data(), light - first_distant + U8(1u), and_not(lanes, in_tree));
  return select(in_tree, F8(pmf_[0]) * tree_->pmf(p, light, in_tree), of_distant);
}

}  // namespace lightmill

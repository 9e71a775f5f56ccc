#include "common/methods/tracer/inscattering.h"

#include "common/math/exp_log.h"
#include "common/methods/tracer/drawn_channel.h"
#include "common/scene/compiled/medium_table.h"

namespace lightmill::tracer {

InscatteringDensity8::InscatteringDensity8(const EquiangularLights& lights, const V8& origin, const V8& direction,
                                           F8 length, const V8& scattered, const V8& extinction)
    : extinction_(extinction), length_(length) {
  const F8 zero(0.0f);
  const auto lost = [&](F8 sigma) { return -expm1(-masked(sigma > zero, sigma * length)); };
  lost_ = {lost(extinction.x), lost(extinction.y), lost(extinction.z)};
  const auto reach = [&](F8 sigma, F8 lost) { return masked(sigma > zero, lost / sigma); };  // ∫ transmittance
  const V8 reaches{reach(extinction.x, lost_.x), reach(extinction.y, lost_.y), reach(extinction.z, lost_.z)};
  total_ = dot(scattered, reaches);
  valid_ = (total_ > zero) & (total_ < F8(std::numeric_limits<float>::infinity()));
  const F8 mean_reach = total_ / (scattered.x + scattered.y + scattered.z);
  lights_ = lights.mixture(origin, direction, length, select(valid_, mean_reach, F8(1.0f)));
  weight_ = scattered * (F8(1.0f) / total_);
  share_ = weight_ * reaches;
}

F8 InscatteringDensity8::sample(Pair8 u) const {
  // A channel is drawn by its part of the density, then a distance before the end.
  const F8 channel = u.u / lights_.rest;
  const F8 lost = drawn_channel(lost_, share_, channel);
  const F8 by_transmittance = min(-log1p(-(u.v * lost)) / drawn_channel(extinction_, share_, channel), length_);
  const M8 towards_light = u.u >= lights_.rest;
  return towards_light.any() ? select(towards_light, lights_.sample(u), by_transmittance) : by_transmittance;
}

F8 InscatteringDensity8::pdf_length(F8 distance) const {
  return lights_.rest * dot(weight_, MediumTable::transmittance(extinction_, distance)) + lights_.pdf_length(distance);
}

}  // namespace lightmill::tracer

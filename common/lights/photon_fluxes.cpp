#include "common/lights/photon_fluxes.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "common/lights/light_emission.h"
#include "common/lights/photometry.h"

namespace lightmill {
namespace {

/// Batches of eight points and directions: per light and target, and in all.
constexpr std::size_t kMaxBatches = 8, kAllBatches = std::size_t{1} << 17;
constexpr double kMinShareOfPower = 1.0 / 16;

/// Whether some of the target is on the side of the plane's normal.
bool reaches_beyond(const Vec3d& point, const Vec3d& normal, const BoundingSphere& target) {
  return glm::dot(target.center - point, normal) > -target.radius;
}

/// Whether a cone of light about a unit axis meets the target. Its half angle is given as 1 − cos.
bool reaches(const Vec3d& point, const Vec3d& axis, double one_minus_cos, const BoundingSphere& target) {
  const Vec3d to_target = target.center - point;
  const double distance = glm::length(to_target);
  if (distance <= target.radius) {
    return true;
  }
  const double sine = std::sqrt(one_minus_cos * (2 - one_minus_cos));
  const double half = atan2_fixed(sine, 1 - one_minus_cos);
  const double width = atan2_fixed(target.radius, std::sqrt(distance * distance - target.radius * target.radius));
  const double off_axis = atan2_fixed(glm::length(glm::cross(to_target, axis)), glm::dot(to_target, axis));
  return off_axis <= half + width + 1e-6;
}

/// Lights of one kind, by their index within it.
struct Kind {
  std::uint32_t first = 0;
  std::size_t size = 0;
  std::function<double(std::size_t)> power;                           ///< luminance of the flux
  std::function<bool(std::size_t, const BoundingSphere&)> can_reach;  ///< false if it provably cannot
};

class Estimate {
 public:
  Estimate(const LightTable& lights, std::span<const BoundingSphere> targets, const PhotonAim& aim)
      : lights_(lights), emission_(lights), targets_(targets), aim_(aim) {
    const std::size_t pairs = std::max<std::size_t>(emission_.first_distant() * targets.size(), 1);
    batches_ = std::clamp<std::size_t>(kAllBatches / pairs, 1, kMaxBatches);
  }

  PhotonFluxes all(bool unsampled);

 private:
  void add_near(const Kind& kind);
  void add_distant(std::uint32_t light, double irradiance);
  void add(std::uint32_t light, const std::vector<double>& fluxes);
  double to_target(std::uint32_t light, std::size_t target, double power) const;

  const LightTable& lights_;
  LightEmission emission_;
  std::span<const BoundingSphere> targets_;
  const PhotonAim& aim_;
  std::size_t batches_;
  PhotonFluxes out_;
};

double Estimate::to_target(std::uint32_t light, std::size_t target, double power) const {
  const U8 lights(light);
  const M8 all(true);
  double flux = 0, solid_angle = 0;
  for (std::uint32_t batch = 0; batch < batches_; ++batch) {
    const U8 index = U8(8 * batch) + U8::lane_index();
    const EmissionPoint8 from = emission_.point_on(lights, all, sobol_pair(index, U8(0x3c6ef372u)));
    const PhotonAim::Direction8 aimed = aim_.direction_to(target, from, sobol_pair(index, U8(0x9e3779b9u)));
    const VectorLanes intensity(emission_.intensity(lights, from, aimed.direction, all));
    alignas(32) float pdf[8];
    aimed.pdf_solid_angle.store(pdf);
    for (int lane = 0; lane < 8; ++lane) {
      if (pdf[lane] > 0) {
        flux += luminance(intensity[lane]) / pdf[lane];
        solid_angle += 1.0 / pdf[lane];
      }
    }
  }
  const double draws = static_cast<double>(8 * batches_);
  return std::max(flux / draws, std::min(solid_angle / draws / (4 * kPiDouble), 1.0) * power * kMinShareOfPower);
}

void Estimate::add(std::uint32_t light, const std::vector<double>& fluxes) {
  if (std::ranges::any_of(fluxes, [](double f) { return f > 0; })) {
    out_.lights.push_back(light);
    out_.luminance.insert(out_.luminance.end(), fluxes.begin(), fluxes.end());
  }
}

void Estimate::add_near(const Kind& kind) {
  std::vector<double> fluxes(targets_.size());
  for (std::size_t i = 0; i < kind.size; ++i) {
    const double power = kind.power(i);
    const std::uint32_t light = kind.first + static_cast<std::uint32_t>(i);
    for (std::size_t t = 0; t < targets_.size(); ++t) {
      fluxes[t] = power > 0 && kind.can_reach(i, targets_[t]) ? to_target(light, t, power) : 0;
    }
    add(light, fluxes);
  }
}

/// `irradiance`: sum over all directions, each across itself.
void Estimate::add_distant(std::uint32_t light, double irradiance) {
  std::vector<double> fluxes;
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    fluxes.push_back(irradiance * aim_.projected_area(t));
  }
  add(light, fluxes);
}

PhotonFluxes Estimate::all(bool unsampled) {
  const auto near = [&](LightKind kind, const auto& lights, auto can_reach) {
    add_near({lights_.first(kind), lights.size(), [&](std::size_t i) { return lights.bounds(i).power; }, can_reach});
  };
  const auto anywhere = [](std::size_t, const BoundingSphere&) { return true; };
  near(LightKind::facet, lights_.facets, [&](std::size_t i, const BoundingSphere& target) {
    const LightBounds b = lights_.facets.bounds(i);
    return b.two_sided || reaches_beyond(Vec3d(lights_.facets.facet(i).corner), b.axis, target);
  });
  near(LightKind::sphere, lights_.spheres, [&](std::size_t i, const BoundingSphere& target) {
    return lights_.spheres.can_reach(i, target.center, target.radius);
  });
  near(LightKind::disk, lights_.disks, [&](std::size_t i, const BoundingSphere& target) {
    const LightBounds b = lights_.disks.bounds(i);
    const BoundingSphere for_center{target.center, target.radius + glm::length(b.high - b.low) / 2};
    return reaches((b.low + b.high) * 0.5, b.axis, 1 - b.cos_emission, for_center);
  });
  near(LightKind::point, lights_.points, anywhere);
  near(LightKind::spot, lights_.spots, [&](std::size_t i, const BoundingSphere& target) {
    const LightBounds b = lights_.spots.bounds(i);
    const BoundingSphere for_center{target.center, target.radius + lights_.spots.radii()[i]};
    return reaches((b.low + b.high) * 0.5, b.axis, lights_.spots.one_minus_cos_cutoff(i), for_center);
  });
  near(LightKind::cosine_power, lights_.cosine_powers, [&](std::size_t i, const BoundingSphere& target) {
    const LightBounds b = lights_.cosine_powers.bounds(i);
    return reaches_beyond(b.low, b.axis, target);
  });
  near(LightKind::ies, lights_.ies, anywhere);
  for (std::size_t i = 0; i < lights_.directional.size(); ++i) {
    add_distant(emission_.first_distant() + static_cast<std::uint32_t>(i), lights_.directional.bounds(i).irradiance);
  }
  if (unsampled ? lights_.environment.exists() : lights_.environment.samplable()) {
    add_distant(lights_.first(LightKind::environment), lights_.environment.irradiance());
  }
  return std::move(out_);
}

}  // namespace

PhotonFluxes estimate_fluxes(const LightTable& lights, std::span<const BoundingSphere> targets, const PhotonAim& aim,
                             bool unsampled) {
  return Estimate(lights, targets, aim).all(unsampled);
}

}  // namespace lightmill

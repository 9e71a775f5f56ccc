#include "common/lights/photon_emission.h"

#include <algorithm>

#include "common/lights/photon_fluxes.h"
#include "common/sampling/discrete.h"

namespace lightmill {
namespace {

/// With this many lights, targets are merged into fewer.
constexpr std::size_t kManyLights = std::size_t{1} << 17, kFewTargets = 4;
/// Number of entries among which 24 bits choose with different probabilities.
constexpr std::size_t kMaxEntries = std::size_t{1} << 20;

// Estimates may be far too small. So each light that reaches a target has at least this share of the mean flux per
// light, and each target at least this share of its light's flux.
constexpr double kMinLightShare = 1.0 / 64, kMinTargetShare = 0x1p-12;

/// Extra distance at which parallel light starts before the scene or a plane, in scene radii.
constexpr float kAhead = 0x1p-6f;
/// Planes parallel to the light within rounding are not crossed.
constexpr float kAlongPlane = 0x1p-22f;

void raise_least(std::span<double> fluxes) {
  const double least = sum_of(fluxes) / static_cast<double>(fluxes.size()) * kMinLightShare;
  const double resolved = sum_of(fluxes) * 0x1p-22;
  for (double& f : fluxes) {
    f = std::max({f, least, resolved});
  }
}

}  // namespace

PhotonEmission::PhotonEmission(const LightTable& lights, std::span<const BoundingSphere> targets,
                               std::span<const InfinitePlane> planes, const BoundingSphere& scene, bool unsampled)
    : sources_(lights),
      planes_(planes.begin(), planes.end()),
      scene_center_(scene.center),
      scene_radius_(static_cast<float>(scene.radius)) {
  if (targets.empty()) {
    return;
  }
  const std::size_t most = lights.size() < kManyLights ? kMaxPhotonTargets : kFewTargets;
  const std::vector<BoundingSphere> groups = group_targets(targets, most);
  aim_ = PhotonAim(groups, scene);
  const PhotonFluxes fluxes = estimate_fluxes(lights, groups, aim_, unsampled);
  lights_ = fluxes.lights;
  if (!lights_.empty()) {
    pmf_of_light_.assign(lights.size() + 1, 0.0f);
    entry_of_light_.assign(lights.size() + 1, 0);
    build_choice(fluxes);
  }
}

void PhotonEmission::build_choice(const PhotonFluxes& fluxes) {
  const std::size_t targets = aim_.size();
  block_ = (lights_.size() + kMaxEntries - 1) / kMaxEntries;
  std::vector<double> entries;
  for (std::size_t first = 0; first < lights_.size(); first += block_) {
    std::vector<double> of_targets(targets, 0.0);
    for (std::size_t i = first; i < std::min(first + block_, lights_.size()); ++i) {
      for (std::size_t t = 0; t < targets; ++t) {
        of_targets[t] += fluxes.luminance[i * targets + t];
      }
    }
    entries.push_back(sum_of(of_targets));
    balance(of_targets);
    append_cumulative(of_targets, by_target_);
  }
  raise_least(entries);
  by_flux_ = DiscreteDistribution(entries);
  for (std::size_t i = 0; i < lights_.size(); ++i) {
    const std::size_t entry = i / block_, sharing = std::min(block_, lights_.size() - entry * block_);
    pmf_of_light_[lights_[i]] = by_flux_.pmf(entry) / static_cast<float>(sharing);
    entry_of_light_[lights_[i]] = static_cast<std::uint32_t>(entry);
  }
}

/// Limits the infinite target's share to half if there are finite targets. Most of the light towards it may miss them
/// by far.
void PhotonEmission::balance(std::vector<double>& fluxes) const {
  const std::size_t last = fluxes.size() - 1;
  if (aim_.infinite(last)) {
    const double finite = sum_of(std::span(fluxes).first(last));
    fluxes[last] = finite > 0 ? std::min(fluxes[last], finite) : fluxes[last];
  }
  const double least = sum_of(fluxes) * kMinTargetShare;
  for (double& f : fluxes) {
    f = f > 0 ? std::max(f, least) : 0;
  }
}

/// Moves back along the direction until the scene's sphere and all planes lie ahead.
V8 PhotonEmission::start_of(const V8& place, const V8& direction) const {
  const F8 radius(scene_radius_);
  F8 back = dot(place - broadcast(scene_center_), direction) + radius * F8(1 + kAhead);
  for (const InfinitePlane& plane : planes_) {
    const V8 normal = broadcast(Vec3(plane.normal));
    const F8 across = dot(direction, normal);
    const F8 crossed = dot(place - broadcast(Vec3(plane.point)), normal) / across;
    // The distance beyond the plane exceeds rounding errors along the normal.
    const F8 ahead = max(radius * F8(kAhead), (radius + crossed) * F8(0x1p-19f) / abs(across));
    const M8 behind = (abs(across) > F8(kAlongPlane)) & (crossed + ahead > back);
    back = select(behind, min(crossed + ahead, F8(kFarAway)), back);
  }
  return place - direction * back;
}

PhotonEmission::Chosen8 PhotonEmission::choose(Pair8 choice) const {
  const DiscreteDistribution::Choice8 entry = by_flux_.sample(choice.u);
  Chosen8 out;
  out.pmf = entry.pmf;
  U8 row = entry.index;
  if (block_ > 1) {
    const U8 first = row * U8(static_cast<std::uint32_t>(block_));
    const U8 left = U8(static_cast<std::uint32_t>(lights_.size())) - first;
    const U8 block(static_cast<std::uint32_t>(block_));
    const U8 size = select(signed_less(left, block), left, block);
    // The bits of the numbers are used up, so their hash serves as another number.
    const F8 more = hashed_number(float_bits(choice.u), float_bits(choice.v));
    row = first + truncate(more * to_float(size));
    out.pmf = out.pmf / to_float(size);
  }
  const M8 all(true);
  out.light = gather(lights_.data(), row, all);
  const auto targets = static_cast<std::uint32_t>(aim_.size());
  const U8 first_target = entry.index * U8(targets + 1);
  out.targets.target = U8(0u);
  F8 below(0.0f);
  for (std::uint32_t t = 0; t < targets; ++t) {
    const F8 next = gather(by_target_.data(), first_target + U8(t + 1), all);
    out.targets.pmf[t] = next - below;
    below = next;
    if (t + 1 < targets) {
      out.targets.target = select(next <= choice.v, U8(t + 1), out.targets.target);
    }
  }
  return out;
}

void PhotonEmission::aim_near(const Chosen8& chosen, M8 lanes, Pair8 position, Pair8 direction, Photon8& out) const {
  EmissionPoint8 from = sources_.point_on(chosen.light, lanes, position);
  PhotonAim::Choice8 targets = chosen.targets;
  if (const LightEmission::LightSpheres8 spheres = sources_.spheres(chosen.light, lanes); spheres.lanes.any()) {
    const V8 normal = aim_.facing(spheres, targets, position);
    from = merge(spheres.lanes, sources_.point_on_sphere(chosen.light, spheres.lanes, normal), from);
  }
  const PhotonAim::Direction8 aimed = aim_.direction(from, targets, direction);
  const V8 along = sources_.intensity(chosen.light, from, aimed.direction, lanes);
  const V8 off = from.normal * copysign(from.offset, dot(aimed.direction, from.normal));
  out.origin = select(lanes, from.point + masked(from.surface, off), out.origin);
  out.direction = select(lanes, aimed.direction, out.direction);
  out.power = select(lanes, along * (F8(1.0f) / (aimed.pdf_solid_angle * chosen.pmf)), out.power);
  const M8 lit = (aimed.pdf_solid_angle > F8(0.0f)) & (max_component(along) > F8(0.0f));
  out.valid = out.valid | (lanes & lit);
  out.cosine = select(lanes, select(from.surface, abs(dot(aimed.direction, from.normal)), F8(1.0f)), out.cosine);
}

void PhotonEmission::aim_distant(const Chosen8& chosen, M8 lanes, Pair8 position, Pair8 direction, Photon8& out) const {
  const LightEmission::Parallel8 light = sources_.parallel(chosen.light, lanes, direction);
  const PhotonAim::Place8 place = aim_.place(light.direction, chosen.targets, position);
  out.origin = select(lanes, start_of(place.point, light.direction), out.origin);
  out.direction = select(lanes, light.direction, out.direction);
  out.power = select(lanes, light.irradiance * (F8(1.0f) / (place.pdf_area * chosen.pmf)), out.power);
  out.valid = out.valid | (lanes & (max_component(light.irradiance) > F8(0.0f)));
  out.cosine = select(lanes, F8(1.0f), out.cosine);
}

F8 PhotonEmission::pdf(U8 light, const V8& point, const V8& direction, F8 cosine, M8 lanes) const {
  if (empty()) {
    return F8(0.0f);
  }
  PhotonAim::Choice8 targets{};
  const U8 row = gather(entry_of_light_.data(), light, lanes) * U8(static_cast<std::uint32_t>(aim_.size() + 1));
  for (std::uint32_t t = 0; t < aim_.size(); ++t) {
    targets.pmf[t] = gather(by_target_.data(), row + U8(t + 1), lanes) - gather(by_target_.data(), row + U8(t), lanes);
  }
  const M8 near = lanes & signed_less(light, U8(sources_.first_distant()));
  F8 density(0.0f);
  if (near.any()) {
    EmissionPoint8 from = sources_.point_on(light, near, {F8(0.0f), F8(0.0f)});
    from.point = point;
    from.normal = direction * cosine;  // the direction's density depends only on the cosine
    density = aim_.pdf_solid_angle(from, targets, direction) * select(from.surface, F8(1.0f) / from.area, F8(1.0f));
  }
  if (const M8 distant = and_not(lanes, near); distant.any()) {
    const F8 across = aim_.pdf_area(point, direction, targets) * sources_.parallel_pdf(light, distant, direction);
    density = select(distant, across, density);
  }
  return masked(lanes, density * gather(pmf_of_light_.data(), light, lanes));
}

PhotonEmission::Photon8 PhotonEmission::emit(Pair8 choice, Pair8 position, Pair8 direction) const {
  if (empty()) {
    return {};
  }
  const Chosen8 chosen = choose(choice);
  const M8 near = signed_less(chosen.light, U8(sources_.first_distant()));
  Photon8 out{};
  out.light = chosen.light;
  if (near.any()) {
    aim_near(chosen, near, position, direction, out);
  }
  if ((~near).any()) {
    aim_distant(chosen, ~near, position, direction, out);
  }
  out.power = masked(out.valid, out.power);
  return out;
}

}  // namespace lightmill

#include "common/methods/photons/photon_passes.h"

#include "common/math/transcendental.h"
#include "common/methods/float_environment.h"

namespace lightmill::photons {
namespace {

/// Radii shrink with the pass p of a half: r² ∝ p^(α − 1), α = 2/3 (Knaus and Zwicker 2011, "Progressive Photon
/// Mapping: A Probabilistic Approach", limit of the closed form).
double radius_factor(std::uint64_t sample) {
  return cube_root_fixed(1 / std::sqrt(static_cast<double>((sample >> 1) + 1)));
}

/// The same in media: r³ ∝ p^(β − 1), β = 4/7. Of the exponents for points in a volume this one has the least error
/// (the same paper). So the radius falls as the seventh root, which Newton's method finds from above.
double media_radius_factor(std::uint64_t sample) {
  const double passes = static_cast<double>((sample >> 1) + 1);
  double root = 1;
  constexpr int kSteps = 64;  // each divides the error by 7/6 at least, and at the end squares it
  for (int i = 0; i < kSteps; ++i) {
    const double third = root * root * root;
    root = (6 * root + 1 / (passes * third * third)) / 7;
  }
  return root;
}

/// `wanted`, or fewer, so that at most kMaxStored photons are stored. Trials with fixed seeds estimate the stored
/// photons per emitted photon. Three standard errors are added. The result does not depend on the job's seed.
std::uint32_t limited_photons(std::uint32_t wanted, PhotonPassPlan trial,
                              const std::function<std::size_t(const PhotonPassPlan&)>& stored) {
  constexpr std::uint32_t kTrials = 16, kTried = 64, kTriedSeed = 0x74726965u;
  if (std::uint64_t{wanted} * trial.max_bounces <= kMaxStored) {
    return wanted;
  }
  const FixedFloatEnvironment float_environment;
  trial.photons = kTried;
  double sum = 0, squares = 0;
  for (std::uint32_t i = 0; i < kTrials; ++i) {
    trial.seed = kTriedSeed + i;
    const double photons = static_cast<double>(stored(trial)) / kTried;
    sum += photons;
    squares += photons * photons;
  }
  const double mean = sum / kTrials, variance = squares / kTrials - mean * mean;
  const double most = mean + 3 * std::sqrt(std::max(variance, 0.0) / (kTrials - 1));
  return most * wanted <= kMaxStored ? wanted : static_cast<std::uint32_t>(kMaxStored / most);
}

}  // namespace

float PhotonPassPlan::meter_radius(const CompiledScene& scene, const CompiledMeter& meter) const {
  return radius_per_length * kind.meter_radius * glm::length(meter.corner - scene.camera().position);
}

float PhotonPassPlan::meter_area(const CompiledScene& scene, const CompiledMeter& meter) const {
  if (meter.edge1 == Vec3(0)) {
    const float radius = meter_radius(scene, meter);
    return kPi * radius * radius;
  }
  return glm::length(glm::cross(meter.edge1, meter.edge2));
}

std::uint64_t PhotonPass::bytes() const {
  std::uint64_t sum = stored() * sizeof(Photon) + splats.bytes() + media_splats.bytes();
  for (const auto& hits : meters) {
    sum += hits.size() * sizeof(MeterHit);
  }
  return sum;
}

double default_radius(const CompiledScene& scene, const PhotonKind& kind) {
  constexpr double kMaxOfDistance = 0.05;
  return std::min(kind.radius, kMaxOfDistance / glm::length(scene.camera().right));
}

std::uint32_t default_photons(const CompiledScene& scene, const PhotonKind& kind) {
  const std::uint64_t pixels = std::uint64_t{1} * scene.film_width() * scene.film_height();
  return static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(pixels / kind.pixels_per_photon, kMinDefaultPhotons, kMaxDefaultPhotons));
}

PhotonPassSettings pass_settings(const MethodSettings& settings, const MethodSpec& spec, const PhotonKind& kind) {
  return {kind, settings.seed, bounce_limit(settings.max_bounces), spec.photons.value_or(0), spec.radius.value_or(0)};
}

PhotonPassSettings completed(const CompiledScene& scene, PhotonPassSettings settings, const PhotonEmission& emission,
                             const std::function<std::size_t(const PhotonPassPlan&)>& stored) {
  if (settings.photons == 0) {
    settings.photons = default_photons(scene, settings.kind);
  }
  if (settings.radius == 0) {
    settings.radius = default_radius(scene, settings.kind);
  }
  settings.max_bounces = std::min(settings.max_bounces, kMaxScatterings);
  if (!emission.empty()) {
    settings.photons = limited_photons(
        settings.photons, {.kind = settings.kind, .max_bounces = settings.max_bounces, .radius_per_length = 1}, stored);
  }
  return settings;
}

PhotonPassPlan plan_of(const CompiledScene& scene, const PhotonPassSettings& settings, std::uint64_t sample) {
  const std::uint32_t seed = pixel_seed(settings.seed, static_cast<std::uint32_t>(sample >> 1), 0x70686f74u,
                                        static_cast<std::uint32_t>(sample & 1));
  const double pixel = glm::length(scene.camera().right), in_media = media_radius_factor(sample);
  return {.kind = settings.kind,
          .photons = settings.photons,
          .seed = seed,
          .max_bounces = settings.max_bounces,
          .radius_per_length = static_cast<float>(settings.radius * radius_factor(sample) * pixel),
          .media_radius_per_length = static_cast<float>(kMediaRadius * settings.radius * in_media * pixel),
          .media_free_paths = static_cast<float>(kMediaFreePaths * in_media)};
}

}  // namespace lightmill::photons

#include "common/methods/photons/photon_passes.h"

#include <numeric>

#include "common/math/transcendental.h"
#include "common/methods/float_environment.h"

namespace lightmill::photons {
namespace {

/// A connected light path helps more pixels than a gathered photon.
constexpr std::uint32_t pixels_per_photon(PhotonKind kind) {
  return kind == PhotonKind::light_path ? 4 : 16;
}
constexpr std::uint64_t kLookAhead = 16;  ///< passes that threads may trace ahead

/// Radii shrink with the pass p of a half: r² ∝ p^(α − 1), α = 2/3 (Knaus and Zwicker 2011, "Progressive Photon
/// Mapping: A Probabilistic Approach", limit of the closed form).
double radius_factor(std::uint64_t sample) {
  return cube_root_fixed(1 / std::sqrt(static_cast<double>((sample >> 1) + 1)));
}

/// Merging radii grow with the distance from the camera, between these multiples of the scene's radius.
constexpr float kLeastDistance = 1.0f / 256, kMostDistance = 8;

/// Radius of point meters, in gather radii. Merging radii are smaller, so the factor for light paths is larger.
constexpr float meter_radius(PhotonKind kind) {
  return PhotonPass::kLater * (kind == PhotonKind::light_path ? 3 : 1);
}

/// Sets the photon maps and the limits of gather radii.
void map_to_gather(const Vec3& camera, PhotonPass& pass) {
  std::vector<std::uint32_t> first, later;
  const bool all = pass.kind == PhotonKind::global;
  double sum = 0;
  for (std::uint32_t i = 0; i < pass.photons.size(); ++i) {
    (all || pass.photons[i].first == 1 ? first : later).push_back(i);
    const double distance = glm::length(pass.photons[i].point - camera);
    sum += all ? 1 / (distance + 1e-30) : distance;
  }
  // Global photons reach far out on infinite planes. The harmonic mean keeps the radii near the camera small.
  const auto count = static_cast<double>(pass.photons.size());
  const double mean = all ? count / sum : sum / count;
  const auto typical = std::max(static_cast<float>(pass.radius_per_length * mean), 0x1p-60f);
  pass.least = typical / 4;
  pass.most = typical * 4;
  pass.first = PhotonMap(pass.photons, first, 2 * typical);
  pass.later = PhotonMap(pass.photons, later, 2 * PhotonPass::kLater * typical);
}

/// Sorts stored photons by path. The photons of one path are in order, but mixed with those of others.
void sort_by_path(PhotonTrace traced, PhotonPass& pass) {
  pass.path_first.assign(pass.emitted + 1, 0);
  for (const std::uint32_t path : traced.path) {
    ++pass.path_first[path + 1];
  }
  std::partial_sum(pass.path_first.begin(), pass.path_first.end(), pass.path_first.begin());
  std::vector<std::uint32_t> next = pass.path_first;
  pass.path_photons.resize(traced.path.size());
  for (std::uint32_t i = 0; i < traced.path.size(); ++i) {
    pass.path_photons[next[traced.path[i]]++] = i;
  }
  pass.d_vcm = std::move(traced.d_vcm);
  pass.d_vc = std::move(traced.d_vc);
}

}  // namespace

std::uint64_t PhotonPass::bytes() const {
  std::uint64_t sum = sizeof(PhotonPass) + photons.size() * sizeof(Photon) + splats.bytes() + first.bytes() +
                      later.bytes() + merge_map.bytes();
  sum += 4 * (d_vcm.size() + d_vc.size() + path_first.size() + path_photons.size());
  for (const auto& hits : meters) {
    sum += hits.size() * sizeof(MeterHit);
  }
  return sum;
}

float PhotonPass::meter_area(const CompiledMeter& meter) const {
  if (meter.edge1 == Vec3(0)) {
    const float radius = point_meter_radius_per_distance * glm::length(meter.corner - merging.camera);
    return kPi * radius * radius;
  }
  return glm::length(glm::cross(meter.edge1, meter.edge2));
}

double default_radius(const CompiledScene& scene, PhotonKind kind) {
  constexpr double kMostOfDistance = 0.05;
  const double radius = kind == PhotonKind::global ? 3 : kind == PhotonKind::light_path ? 0.5 : 1.5;
  return std::min(radius, kMostOfDistance / glm::length(scene.camera().right));
}

std::uint32_t default_photons(const CompiledScene& scene, PhotonKind kind) {
  const std::uint64_t pixels = std::uint64_t{1} * scene.film_width() * scene.film_height();
  return static_cast<std::uint32_t>(
      std::clamp<std::uint64_t>(pixels / pixels_per_photon(kind), kLeastDefaultPhotons, kMostDefaultPhotons));
}

PhotonPassSettings pass_settings(const MethodSettings& settings, const MethodSpec& spec, PhotonKind kind) {
  return {settings.seed, bounce_limit(settings.max_bounces), spec.photons.value_or(0), spec.radius.value_or(0),
          kind,          kind != PhotonKind::global};
}

/// Returns `wanted`, or fewer, so that at most kMostStored photons are stored. Trials with fixed seeds estimate the
/// stored photons per emitted photon. Three standard errors are added. The result does not depend on the job's seed.
std::uint32_t PhotonPasses::photons_of_pass(std::uint32_t wanted) const {
  constexpr std::uint32_t kTrials = 16, kTried = 64, kTriedSeed = 0x74726965u;
  if (source_.emission.empty() || std::uint64_t{wanted} * settings_.max_bounces <= kMostStored) {
    return wanted;
  }
  const FixedFloatEnvironment float_environment;
  RenderCounters counters;
  const MergeRadii merging{scene_.camera().position, 1, 1, 1};
  double sum = 0, squares = 0;
  for (std::uint32_t trial = 0; trial < kTrials; ++trial) {
    const PhotonTrace tried = trace_photons(
        scene_, source_, {kTried, kTriedSeed + trial, settings_.max_bounces, settings_.kind, 1, merging}, counters);
    const double photons = static_cast<double>(tried.photons.size()) / kTried;
    sum += photons;
    squares += photons * photons;
  }
  const double mean = sum / kTrials, variance = squares / kTrials - mean * mean;
  const double most = mean + 3 * std::sqrt(std::max(variance, 0.0) / (kTrials - 1));
  return most * wanted <= kMostStored ? wanted : static_cast<std::uint32_t>(kMostStored / most);
}

PhotonPasses::PhotonPasses(const CompiledScene& scene, const PhotonPassSettings& settings)
    : scene_(scene), settings_(settings), source_(photon_source(scene, settings.kind)) {
  if (settings_.photons == 0) {
    settings_.photons = default_photons(scene, settings.kind);
  }
  if (settings_.radius == 0) {
    settings_.radius = default_radius(scene, settings_.kind);
  }
  settings_.max_bounces = std::min(settings_.max_bounces, kMostScatterings);
  settings_.photons = photons_of_pass(settings_.photons);
}

std::shared_ptr<const PhotonPass> PhotonPasses::trace(std::uint64_t sample, RenderCounters& counters,
                                                      const std::stop_token& stop) const {
  const double radius = settings_.radius * radius_factor(sample);
  const auto per_length = static_cast<float>(radius * glm::length(scene_.camera().right));
  const std::uint32_t seed = pixel_seed(settings_.seed, static_cast<std::uint32_t>(sample >> 1), 0x70686f74u,
                                        static_cast<std::uint32_t>(sample & 1));
  const auto extent = static_cast<float>(scene_.caustic_targets().scene.radius) * per_length;
  const MergeRadii merging{scene_.camera().position, per_length, kLeastDistance * extent, kMostDistance * extent};
  RenderCounters own;
  PhotonTrace traced = trace_photons(scene_, source_,
                                     {settings_.photons, seed, settings_.max_bounces, settings_.kind,
                                      per_length * meter_radius(settings_.kind), merging},
                                     own, stop);
  if (stop.stop_requested()) {
    return nullptr;
  }
  counters.photons += settings_.photons;
  counters.photon_rays += own.closest_hit_rays;
  counters.stored_photons += traced.photons.size();
  auto pass = std::make_shared<PhotonPass>();
  pass->photons = std::move(traced.photons);
  pass->meters = std::move(traced.meters);
  pass->radius_per_length = per_length;
  pass->kind = settings_.kind;
  const double photons = std::max<std::uint32_t>(traced.started, 1);
  pass->emitted = settings_.photons;
  pass->merging = merging;
  pass->point_meter_radius_per_distance = per_length * meter_radius(settings_.kind);
  pass->emission = &source_.emission;
  pass->photon_power = static_cast<float>((traced.power.x + traced.power.y + traced.power.z) / (3 * photons));
  if (settings_.kind == PhotonKind::light_path) {
    sort_by_path(std::move(traced), *pass);
  }
  if (pass->photons.empty()) {
    return pass;
  }
  if (settings_.kind == PhotonKind::light_path) {
    pass->merge_map = MergeMap(pass->photons, merging);
  } else {
    map_to_gather(scene_.camera().position, *pass);
  }
  if (settings_.splats) {
    pass->splats = FilmSplats(scene_, pass->photons, seed);
  }
  return pass;
}

std::optional<std::uint64_t> PhotonPasses::claim(std::uint64_t sample, std::uint64_t end) const {
  const std::uint64_t ahead =
      heaviest_ == 0 ? kLookAhead : std::clamp<std::uint64_t>(kHeldPassBytes / heaviest_, 1, kLookAhead);
  for (std::uint64_t next = sample; next < std::min(end, sample + ahead); ++next) {
    if (held_.try_emplace(next).second) {
      return next;
    }
  }
  return std::nullopt;
}

void PhotonPasses::finish(std::uint64_t sample, std::shared_ptr<const PhotonPass> pass) const {
  const MutexLock lock(mutex_);
  if (pass == nullptr) {
    held_.erase(sample);
  } else {
    bytes_ += pass->bytes();
    heaviest_ = std::max<std::uint64_t>(heaviest_, pass->bytes());
    held_[sample] = {std::move(pass), calls_};
    while (bytes_ > kHeldPassBytes) {
      auto oldest = held_.end();
      for (auto it = held_.begin(); it != held_.end(); ++it) {
        if (it->second.pass != nullptr && it->first != sample &&
            (oldest == held_.end() || it->second.used < oldest->second.used)) {
          oldest = it;
        }
      }
      if (oldest == held_.end()) {
        break;
      }
      bytes_ -= oldest->second.pass->bytes();
      held_.erase(oldest);
    }
  }
  changed_.notify_all();
}

std::shared_ptr<const PhotonPass> PhotonPasses::pass(std::uint64_t sample, std::uint64_t end,
                                                     Workspace& workspace) const {
  while (!workspace.stop.stop_requested()) {
    std::optional<std::uint64_t> own;
    {
      const MutexLock lock(mutex_);
      ++calls_;
      if (const auto found = held_.find(sample); found != held_.end() && found->second.pass != nullptr) {
        found->second.used = calls_;
        return found->second.pass;
      }
      own = claim(sample, end);
      if (!own) {
        changed_.wait(mutex_);
        continue;
      }
    }
    std::shared_ptr<const PhotonPass> traced;
    try {
      traced = trace(*own, workspace.counters, workspace.stop);
    } catch (...) {
      finish(*own, nullptr);
      throw;
    }
    finish(*own, traced);
    if (*own == sample) {
      return traced;
    }
  }
  return nullptr;
}

}  // namespace lightmill::photons

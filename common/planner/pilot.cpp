#include "common/planner/pilot.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>

#include "common/math/rel_mse.h"
#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/counted_cost.h"
#include "common/planner/emitter_radiance.h"

namespace lightmill {
namespace {

constexpr int kPatchSide = 8;        ///< pixels
constexpr int kPatchesAcross = 8;    ///< at most, in each direction
constexpr std::uint32_t kLevel = 3;  ///< log2 of a batch's samples
/// From sample 256 on, methods behave as in long renders (roulette, splitting). Before, the ratio of work between two
/// methods differs by a third (docs/evidence/accuracy.md). The batches are the next two ranges of 8.
constexpr std::uint32_t kFirstBatch = 32;
constexpr std::uint64_t kPilotSeed = 0x9e3779b97f4a7c15u;  ///< any constant

/// By half: RGB planes, patch by patch.
using Halves = std::array<std::vector<double>, 2>;

/// One method's means of both batches.
struct Sampled {
  std::array<Halves, 2> means;
  std::array<Halves, 2> caustics;  ///< their part from photons; empty without photons
  std::array<double, 2> cost{};
};

void add(std::span<const float> values, std::size_t first, std::vector<double>& sums) {
  sums.resize(std::max(sums.size(), first + values.size()));
  for (std::size_t i = 0; i < values.size(); ++i) {
    sums[first + i] += static_cast<double>(values[i]);
  }
}

/// Adds the sums of a range, patch by patch.
void add_sums(const Method& method, std::span<const PixelRect> patches, SampleRange range, Workspace& workspace,
              Halves& sums, Halves& caustics) {
  std::size_t first = 0;
  for (const PixelRect& patch : patches) {
    const Node node = method.render(patch, range, workspace);
    if (workspace.stop.stop_requested()) {
      return;
    }
    const std::span<const float> values(node.values);
    const std::size_t rgb = 3 * static_cast<std::size_t>(patch.pixel_count());
    for (const std::size_t half : {0, 1}) {
      const auto own = values.subspan(half * values.size() / 2, values.size() / 2);
      add(own.first(rgb), first, sums[half]);
      add(own.subspan(rgb), first, caustics[half]);
    }
    first += rgb;
  }
}

Sampled sample(const Method& method, const MethodSpec& spec, std::span<const PixelRect> patches,
               std::int64_t film_pixels, const std::stop_token& stop) {
  constexpr double kCount = 1u << kLevel;
  const std::uint32_t level = level_at_a_time(spec, kLevel), pieces = 1u << (kLevel - level);
  std::int64_t pixels = 0;
  for (const PixelRect& patch : patches) {
    pixels += patch.pixel_count();
  }
  Sampled out;
  for (const std::uint32_t batch : {0, 1}) {
    const std::unique_ptr<Workspace> workspace = method.make_workspace();
    workspace->stop = stop;
    for (std::uint32_t piece = 0; piece < pieces; ++piece) {
      add_sums(method, patches, {level, (kFirstBatch + batch) * pieces + piece}, *workspace, out.means[batch],
               out.caustics[batch]);
    }
    for (Halves* sums : {&out.means[batch], &out.caustics[batch]}) {
      for (std::vector<double>& half : *sums) {
        std::ranges::for_each(half, [](double& value) { value /= kCount / 2; });
      }
    }
    const CountedCost cost = cost_of(workspace->counters);
    out.cost[batch] =
        (cost.own / static_cast<double>(pixels) + cost.shared / static_cast<double>(film_pixels)) / kCount;
  }
  return out;
}

/// Mean of all methods, as the reference values. `without`: a batch that is left out, so that its bright samples do not
/// reduce its own error.
std::vector<double> reference_of(std::span<const Sampled> all, const Halves* without = nullptr) {
  std::vector<double> mean(all.front().means[0][0].size());
  const std::size_t halves = 4 * all.size() - (without != nullptr ? 2 : 0);
  for (const Sampled& sampled : all) {
    for (const Halves& batch : sampled.means) {
      for (const std::vector<double>& half : batch) {
        for (std::size_t i = 0; i < mean.size() && &batch != without; ++i) {
          mean[i] += half[i] / static_cast<double>(halves);
        }
      }
    }
  }
  return mean;
}

double scale_of(double reference) {
  return reference * reference + kRelMseFloor;
}

/// Relative variance of one sample, by pixel, from both halves of a batch.
std::vector<double> variances(std::span<const double> a, std::span<const double> b, std::span<const double> reference) {
  std::vector<double> relative(a.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    // (a − b)²/4 is the variance of the batch's mean. Times the number of samples, it is that of one.
    relative[i] = (a[i] - b[i]) * (a[i] - b[i]) / 4 * static_cast<double>(1u << kLevel) / scale_of(reference[i]);
  }
  return relative;
}

double mean(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

PilotMeasure measure(std::span<const Sampled> all, const Sampled& sampled) {
  const std::vector<double> reference = reference_of(all);
  PilotMeasure out;
  out.cost = sampled.cost;
  for (const std::size_t batch : {0, 1}) {
    const auto& [a, b] = sampled.means[batch];
    const auto count = static_cast<double>(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double scale = scale_of(reference[i]);
      out.light[batch] += (a[i] + b[i]) / 2 / std::sqrt(scale) / count;
      out.light_variance[batch] += (a[i] - b[i]) * (a[i] - b[i]) / 4 / scale / (count * count);
    }
    std::vector<double> relative = variances(a, b, reference_of(all, &sampled.means[batch]));
    out.variance[batch] = trimmed_mean(relative);
  }
  return out;
}

/// Expected variances of `path` and `caustic`, computed from `caustic` alone. Both have the variance of the light that
/// both find by camera paths. `path` adds the variance of caustics. It finds these rarely and with large values, so few
/// samples do not show their variance.
///
/// A path that hits a light of radiance L gives X = ρ L, so E[X²] = ρ L E[X], and photons give E[X]. Rough casters show
/// the light darker and larger, as wide as their lobes, because light sampling takes a part. L is the radiance that
/// they show. Nothing is trimmed, because trimming would remove what is rare in both methods.
struct Prediction {
  double path = 0, caustic = 0;
};
Prediction predict(const Sampled& caustic, std::size_t batch, std::span<const PixelRect> patches, const Vec3& radiance,
                   std::span<const double> reference) {
  constexpr double kReflected = 0.7;  ///< typical ρ of bright surfaces
  Halves others = caustic.means[batch];
  double by_chance = 0;
  std::size_t i = 0;
  for (const PixelRect& patch : patches) {
    for (int channel = 0; channel < 3; ++channel) {
      for (std::int64_t pixel = 0; pixel < patch.pixel_count(); ++pixel, ++i) {
        const double a = caustic.caustics[batch][0][i], b = caustic.caustics[batch][1][i];
        others[0][i] -= a;
        others[1][i] -= b;
        by_chance += (a + b) / 2 * kReflected * static_cast<double>(radiance[channel]) / scale_of(reference[i]);
      }
    }
  }
  const auto& [a, b] = caustic.means[batch];
  return {mean(variances(others[0], others[1], reference)) + by_chance / static_cast<double>(i),
          mean(variances(a, b, reference))};
}

}  // namespace

std::vector<PixelRect> pilot_patches(const PixelRect& film) {
  const auto places = [](int from, int length) {
    const int count = std::min(kPatchesAcross, (length + kPatchSide - 1) / kPatchSide);
    std::vector<std::pair<int, int>> out;  // position and length
    for (int i = 0; i < count; ++i) {
      // Each in the middle of its share.
      const auto share = [&](int n) { return from + static_cast<int>(std::int64_t{length} * n / count); };
      const int size = std::min(kPatchSide, share(i + 1) - share(i));
      out.emplace_back(share(i) + (share(i + 1) - share(i) - size) / 2, size);
    }
    return out;
  };
  std::vector<PixelRect> patches;
  for (const auto& [y, height] : places(film.y, film.height)) {
    for (const auto& [x, width] : places(film.x, film.width)) {
      patches.push_back({x, y, width, height});
    }
  }
  return patches;
}

Result<PilotChoice> run_pilot(const std::shared_ptr<const CompiledScene>& scene, const PilotSettings& settings,
                              const std::stop_token& stop) {
  if (settings.methods.empty()) {
    return invalid_argument("a pilot needs a method");
  }
  const std::vector<PixelRect> patches = pilot_patches(settings.film);
  std::vector<Sampled> sampled;
  std::optional<std::size_t> path, caustic;
  for (const std::string& name : settings.methods) {
    LM_ASSIGN_OR_RETURN(const MethodSpec spec, parse_method(name));
    MethodSettings of_method{name, settings.seed ^ kPilotSeed, settings.max_bounces};
    if (spec.name == "path") {
      path = sampled.size();
    } else if (spec.name == "caustic") {
      caustic = sampled.size();
      LM_ASSIGN_OR_RETURN(of_method.layers, film_layers(std::array<std::string, 1>{"caustic"}));
    }
    LM_ASSIGN_OR_RETURN(const std::unique_ptr<Method> method, make_method(scene, of_method));
    sampled.push_back(sample(*method, spec, patches, settings.film.pixel_count(), stop));
    if (stop.stop_requested()) {
      return cancelled("the pilot was stopped");
    }
  }
  std::vector<PilotMeasure> measures;
  std::ranges::transform(sampled, std::back_inserter(measures),
                         [&](const Sampled& each) { return measure(sampled, each); });
  if (path && caustic && !scene->caustic_targets().casters.empty()) {
    const Vec3 radiance = emitter_radiance_in_casters(*scene);
    // The caustics that `path` found in both batches count too, because they are rare.
    double met = 0;
    for (const Halves& batch : sampled[*path].means) {
      met += mean(variances(batch[0], batch[1], reference_of(sampled, &batch))) / 2;
    }
    for (const std::size_t batch : {0, 1}) {
      const Prediction predicted =
          predict(sampled[*caustic], batch, patches, radiance, reference_of(sampled, &sampled[*caustic].means[batch]));
      measures[*path].variance[batch] = std::max(met, predicted.path);
      measures[*caustic].variance[batch] = predicted.caustic;
    }
  }
  return choose(settings.methods, measures);
}

}  // namespace lightmill

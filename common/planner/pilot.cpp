#include "common/planner/pilot.h"

#include <algorithm>

#include "common/methods/method.h"

namespace lightmill {
namespace {

constexpr int kPatchSide = 8;        ///< pixels
constexpr int kPatchesAcross = 8;    ///< at most, either way
constexpr std::uint32_t kLevel = 4;  ///< log2 of a batch's samples
/// From sample 64 on methods do as in long renders (roulette, splitting); the batches are the next two ranges of 16.
constexpr std::uint32_t kFirstBatch = 4;
constexpr std::uint64_t kPilotSeed = 0x9e3779b97f4a7c15u;  ///< any constant
/// A photon's ray with what follows from it (deposits, their map and splats), in rays of camera paths; and workers do
/// the same passes, each for its own tiles.
constexpr double kSharedWork = 3;
constexpr double kRelativeFloor = 0.01;  ///< as in relMSE

CountedWork work_of(const RenderCounters& counters) {
  return {counters.closest_hit_rays, counters.shadow_rays};
}

/// One method's means of both halves of both batches.
struct Sampled {
  std::array<std::array<std::vector<double>, 2>, 2> means;  ///< [batch][half][value]
  std::array<double, 2> cost{};
};

Sampled sample(const Method& method, std::span<const PixelRect> patches, std::int64_t frame_pixels) {
  Sampled out;
  for (const std::size_t batch : {0, 1}) {
    const SampleRange range{kLevel, kFirstBatch + static_cast<std::uint32_t>(batch)};
    const double half_count = static_cast<double>(range.count()) / 2;
    // What a patch needs less of the second time is done once for the whole frame: photons.
    const std::unique_ptr<Workspace> first = method.make_workspace(), again = method.make_workspace();
    method.render(patches.front(), range, *first);
    method.render(patches.front(), range, *again);
    const double shared = cost_of(work_of(first->counters)) - cost_of(work_of(again->counters));
    const std::unique_ptr<Workspace> workspace = method.make_workspace();
    std::uint64_t pixels = 0;
    for (const PixelRect& patch : patches) {
      const Node node = method.render(patch, range, *workspace);
      const std::size_t values = node.values.size() / 2;
      for (const std::size_t half : {0, 1}) {
        for (std::size_t i = 0; i < values; ++i) {
          out.means[batch][half].push_back(static_cast<double>(node.values[half * values + i]) / half_count);
        }
      }
      pixels += static_cast<std::uint64_t>(patch.pixel_count());
    }
    const auto count = static_cast<double>(range.count());
    out.cost[batch] = cost_of(work_of(workspace->counters)) / (static_cast<double>(pixels) * count) +
                      kSharedWork * shared / (static_cast<double>(frame_pixels) * count);
  }
  return out;
}

/// What all methods together take the values to be.
std::vector<double> reference_of(std::span<const Sampled> all) {
  std::vector<double> mean(all.front().means[0][0].size());
  for (const Sampled& sampled : all) {
    for (const auto& batch : sampled.means) {
      for (const std::vector<double>& half : batch) {
        for (std::size_t i = 0; i < mean.size(); ++i) {
          mean[i] += half[i] / static_cast<double>(4 * all.size());
        }
      }
    }
  }
  return mean;
}

PilotMeasure measure(const Sampled& sampled, std::span<const double> reference) {
  PilotMeasure out;
  out.cost = sampled.cost;
  for (const std::size_t batch : {0, 1}) {
    const std::vector<double>&a = sampled.means[batch][0], &b = sampled.means[batch][1];
    std::vector<double> relative(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      // (a − b)²/4 is the variance of the batch's mean; times its samples, that of one.
      const double variance = (a[i] - b[i]) * (a[i] - b[i]) / 4 * static_cast<double>(std::uint64_t{1} << kLevel);
      relative[i] = variance / (reference[i] * reference[i] + kRelativeFloor);
    }
    out.variance[batch] = trimmed_mean(relative);
  }
  return out;
}

}  // namespace

std::vector<PixelRect> pilot_patches(const PixelRect& film) {
  const auto places = [](int from, int length) {
    const int count = std::min(kPatchesAcross, (length + kPatchSide - 1) / kPatchSide);
    std::vector<std::pair<int, int>> out;  // where, and how long
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

Result<PilotChoice> run_pilot(const std::shared_ptr<const CompiledScene>& scene, const PilotSettings& settings) {
  if (settings.methods.empty()) {
    return invalid_argument("a pilot needs a method");
  }
  const std::vector<PixelRect> patches = pilot_patches(settings.film);
  std::vector<Sampled> sampled;
  for (const std::string& name : settings.methods) {
    LM_ASSIGN_OR_RETURN(const std::unique_ptr<Method> method,
                        make_method(scene, {name, settings.seed ^ kPilotSeed, settings.max_bounces}));
    sampled.push_back(sample(*method, patches, settings.film.pixel_count()));
  }
  const std::vector<double> reference = reference_of(sampled);
  std::vector<PilotMeasure> measures;
  std::ranges::transform(sampled, std::back_inserter(measures),
                         [&](const Sampled& each) { return measure(each, reference); });
  return choose(settings.methods, measures);
}

}  // namespace lightmill

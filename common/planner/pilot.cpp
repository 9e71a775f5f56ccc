#include "common/planner/pilot.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "common/methods/method.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/counted_cost.h"

namespace lightmill {
namespace {

constexpr int kPatchSide = 8;        ///< pixels
constexpr int kPatchesAcross = 8;    ///< at most, either way
constexpr std::uint32_t kLevel = 3;  ///< log2 of a batch's samples
/// From sample 64 on methods do as in long renders (roulette, splitting); the batches are the next two ranges of 8.
constexpr std::uint32_t kFirstBatch = 8;
constexpr std::uint64_t kPilotSeed = 0x9e3779b97f4a7c15u;  ///< any constant
constexpr double kRelativeFloor = 0.01;                    ///< as in relMSE

/// One method's means of both halves of both batches.
struct Sampled {
  std::array<std::array<std::vector<double>, 2>, 2> means;  ///< [batch][half][value]
  std::array<double, 2> cost{};
};

/// Of samples that patches share, no more at a time than are held.
std::uint32_t level_at_a_time(const MethodSpec& method) {
  const std::uint32_t held = shared_samples(method);
  return held == 0 ? kLevel : std::min(kLevel, static_cast<std::uint32_t>(std::bit_width(held) - 1));
}

/// Adds the sums of a range of all patches, patch by patch.
void add_sums(const Method& method, std::span<const PixelRect> patches, SampleRange range, Workspace& workspace,
              std::array<std::vector<double>, 2>& sums) {
  std::size_t first = 0;
  for (const PixelRect& patch : patches) {
    const Node node = method.render(patch, range, workspace);
    const std::size_t values = node.values.size() / 2;
    for (const std::size_t half : {0, 1}) {
      sums[half].resize(std::max(sums[half].size(), first + values));
      for (std::size_t i = 0; i < values; ++i) {
        sums[half][first + i] += static_cast<double>(node.values[half * values + i]);
      }
    }
    first += values;
  }
}

Sampled sample(const Method& method, const MethodSpec& spec, std::span<const PixelRect> patches,
               std::int64_t film_pixels) {
  constexpr double kCount = 1u << kLevel;
  const std::uint32_t level = level_at_a_time(spec), pieces = 1u << (kLevel - level);
  std::int64_t pixels = 0;
  for (const PixelRect& patch : patches) {
    pixels += patch.pixel_count();
  }
  Sampled out;
  for (const std::uint32_t batch : {0, 1}) {
    const std::unique_ptr<Workspace> workspace = method.make_workspace();
    for (std::uint32_t piece = 0; piece < pieces; ++piece) {
      add_sums(method, patches, {level, (kFirstBatch + batch) * pieces + piece}, *workspace, out.means[batch]);
    }
    for (std::vector<double>& half : out.means[batch]) {
      std::ranges::for_each(half, [](double& value) { value /= kCount / 2; });
    }
    const CountedCost cost = cost_of(workspace->counters);
    out.cost[batch] =
        (cost.own / static_cast<double>(pixels) + cost.shared / static_cast<double>(film_pixels)) / kCount;
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
    const auto count = static_cast<double>(a.size());
    std::vector<double> relative(a.size());
    for (std::size_t i = 0; i < a.size(); ++i) {
      const double scale = reference[i] * reference[i] + kRelativeFloor;
      const double variance = (a[i] - b[i]) * (a[i] - b[i]) / 4 / scale;  // of the batch's mean
      out.light[batch] += (a[i] + b[i]) / 2 / std::sqrt(scale) / count;
      out.light_variance[batch] += variance / (count * count);
      relative[i] = variance * static_cast<double>(std::uint64_t{1} << kLevel);
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
    LM_ASSIGN_OR_RETURN(const MethodSpec spec, parse_method(name));
    LM_ASSIGN_OR_RETURN(const std::unique_ptr<Method> method,
                        make_method(scene, {name, settings.seed ^ kPilotSeed, settings.max_bounces}));
    sampled.push_back(sample(*method, spec, patches, settings.film.pixel_count()));
  }
  const std::vector<double> reference = reference_of(sampled);
  std::vector<PilotMeasure> measures;
  std::ranges::transform(sampled, std::back_inserter(measures),
                         [&](const Sampled& each) { return measure(each, reference); });
  return choose(settings.methods, measures);
}

}  // namespace lightmill

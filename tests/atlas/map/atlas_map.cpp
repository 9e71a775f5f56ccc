#include "tests/atlas/map/atlas_map.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/methods/photons/gather_pass.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/method_plan.h"
#include "tests/bench/measure.h"
#include "tests/support/read_image.h"
#include "tests/support/render_document.h"

namespace lightmill::test {
namespace {

constexpr int kBlocks = 8;  ///< along a side of a picture, for comparisons of methods
constexpr std::uint64_t kSeed = 9000;
constexpr double kOnePercent = 0.01;
constexpr double kBlur = 0.03;   ///< bias of `ppm`, which gathers all light, as a share of the surroundings
constexpr int kRetryLevels = 4;  ///< log2 of the factor of samples
/// Gather radius of `ppm` in comparisons by block, as a share of a block's side. Its own radius would blur each edge
/// over most of a block. The remaining blur is estimated as in jobs, from a render with half the radius. At edges the
/// blur grows with the radius, so the difference is half of it.
constexpr double kOfBlock = 0.2, kBlurOfDifference = 2;

/// Maximum log2 of a seed's samples for methods with photons, except in retries. Each sample is a pass of thousands of
/// photons.
constexpr int kMaxPassLevel = 8;

/// Results of one method's seeds.
struct Samples {
  std::vector<double> means;                ///< by seed: red channel over the case's rectangle
  std::vector<std::vector<double>> blocks;  ///< by seed: channels innermost
  double mean_blur = 0;
  std::vector<double> block_blur;  ///< empty: no blur
};

Estimate estimate(const std::vector<double>& values) {
  const auto n = static_cast<double>(values.size());
  double sum = 0, squares = 0;
  for (const double value : values) {
    sum += value / n;
  }
  for (const double value : values) {
    squares += (value - sum) * (value - sum);
  }
  return {sum, std::sqrt(squares / (n - 1) / n)};
}

double mean_over(const HalfImages& image, PixelRect rect) {
  if (rect.width == 0) {
    rect = {0, 0, image.width, image.height};
  }
  double sum = 0;
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      sum += image.mean(3 * static_cast<std::size_t>(y * image.width + x));
    }
  }
  return sum / static_cast<double>(rect.pixel_count());
}

std::vector<double> blocks_of(const HalfImages& image) {
  std::vector<double> sums(3 * kBlocks * kBlocks);
  std::vector<double> counts(sums.size());
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int block = y * kBlocks / image.height * kBlocks + x * kBlocks / image.width;
      for (int c = 0; c < 3; ++c) {
        sums[static_cast<std::size_t>(3 * block + c)] +=
            image.mean(3 * static_cast<std::size_t>(y * image.width + x) + static_cast<std::size_t>(c));
        counts[static_cast<std::size_t>(3 * block + c)] += 1;
      }
    }
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    sums[i] /= std::max(counts[i], 1.0);
  }
  return sums;
}

void add_picture(const HalfImages& image, int seeds, RgbImage& picture) {
  picture.width = image.width;
  picture.height = image.height;
  const std::size_t pixels = picture.pixels();
  picture.values.resize(3 * pixels);
  for (std::size_t i = 0; i < 3 * pixels; ++i) {
    picture.values[i % 3 * pixels + i / 3] += static_cast<float>(image.mean(i) / seeds);
  }
}

bool stopped(const AtlasSettings& settings) {
  return settings.stop != nullptr && *settings.stop;
}

/// The method's text with its settings, with `share` of the radius.
std::string spec_of(const std::string& method, const TestScene& scene, const AtlasCase& what, double share) {
  if (method != "ppm" || what.exact) {
    return method;
  }
  const CompiledScene& compiled = *scene.compiled();
  const double resolved = kOfBlock * std::min(compiled.film_width(), compiled.film_height()) / kBlocks;
  return fmt::format("ppm:radius={:.3g}",
                     share * std::min(resolved, photons::default_radius(compiled, photons::kGlobalPhotons)));
}

/// Returns false if it was stopped.
bool render(const TestScene& scene, const AtlasCase& what, const AtlasSettings& settings, int more_levels,
            AtlasCell& cell, Samples& samples, double share_of_radius = 1) {
  const double begin = thread_cpu_seconds();
  const int most = method_gathers(cell.method) ? kMaxPassLevel : 64;
  const int level = std::max(std::min(static_cast<int>(what.level), most) + settings.more_levels + more_levels, 1);
  const std::string spec = spec_of(cell.method, scene, what, share_of_radius);
  samples = {};
  cell.picture = {};
  cell.non_finite = 0;
  for (int seed = 0; seed < settings.seeds; ++seed) {
    if (stopped(settings)) {
      return false;
    }
    const HalfImages image = scene.render({spec, kSeed + static_cast<std::uint64_t>(seed), what.max_bounces},
                                          static_cast<std::uint32_t>(level));
    cell.non_finite += image.non_finite;
    samples.means.push_back(mean_over(image, what.rect));
    if (!what.exact) {
      samples.blocks.push_back(blocks_of(image));
    }
    add_picture(image, settings.seeds, cell.picture);
  }
  cell.cpu_seconds = thread_cpu_seconds() - begin;
  cell.measured = true;
  const Estimate seen = estimate(samples.means);
  cell.mean = seen.value;
  cell.standard_error = seen.standard_error;
  return true;
}

Estimate block_of(const Samples& samples, std::size_t i) {
  std::vector<double> values;
  for (const auto& blocks : samples.blocks) {
    values.push_back(blocks[i]);
  }
  return estimate(values);
}

/// The largest mean of a block and its neighbours in the value's channel. Blur can bring light from there.
double brightest_around(const std::vector<double>& means, std::size_t value) {
  const int block = static_cast<int>(value / 3), channel = static_cast<int>(value % 3);
  double most = 0;
  for (int y = std::max(block / kBlocks - 1, 0); y <= std::min(block / kBlocks + 1, kBlocks - 1); ++y) {
    for (int x = std::max(block % kBlocks - 1, 0); x <= std::min(block % kBlocks + 1, kBlocks - 1); ++x) {
      most = std::max(most, std::abs(means[static_cast<std::size_t>(3 * (y * kBlocks + x) + channel)]));
    }
  }
  return most;
}

/// Renders for a comparison with other methods. Returns false if it was stopped.
bool render_blocks(const TestScene& scene, const AtlasCase& what, const AtlasSettings& settings, int more_levels,
                   AtlasCell& cell, Samples& samples) {
  AtlasCell finer;
  finer.method = cell.method;
  Samples fine;
  if (!render(scene, what, settings, more_levels, cell, samples)) {
    return false;
  }
  if (cell.method != "ppm") {
    return true;
  }
  if (!render(scene, what, settings, more_levels, finer, fine, 0.5)) {
    return false;
  }
  samples.mean_blur = kBlurOfDifference * std::abs(cell.mean - finer.mean);
  std::vector<double> means;
  for (std::size_t i = 0; i < samples.blocks.front().size(); ++i) {
    means.push_back(block_of(samples, i).value);
  }
  for (std::size_t i = 0; i < means.size(); ++i) {
    samples.block_blur.push_back(kBlurOfDifference * std::abs(means[i] - block_of(fine, i).value) +
                                 kBlur * brightest_around(means, i));
  }
  return true;
}

double tolerance_of(const AtlasCase& what, const std::string& method) {
  return what.tolerance + (method_gathers(method) ? what.gathered : 0) + (method == "ppm" && what.exact ? kBlur : 0);
}

/// z, at most kMaxZ either way. All seeds can give the same value, and JSON has no infinite numbers.
double z_of(double difference, double error) {
  const double z = error > 0 ? std::abs(difference) / error : difference == 0 ? 0 : kMaxZ;
  return std::copysign(std::min(z, kMaxZ), difference);
}

void fill_in_time(AtlasCell& cell, double unit) {
  const double share = cell.standard_error / (kOnePercent * std::abs(unit));
  cell.seconds_to_percent = cell.cpu_seconds * share * share;
}

void judge(const AtlasCase& what, AtlasCell& cell, const std::string& why_wrong) {
  if (cell.outcome == Outcome::vetoed) {
    return;
  }
  if (cell.non_finite > 0) {
    cell.outcome = Outcome::wrong;
    cell.reason = fmt::format("{} samples are not finite", cell.non_finite);
  } else if (!why_wrong.empty()) {
    cell.outcome = Outcome::wrong;
    cell.reason = why_wrong;
  } else {
    cell.outcome = cell.seconds_to_percent > what.seconds_to_percent ? Outcome::slow : Outcome::right;
  }
}

void compare_with_formula(const AtlasCase& what, AtlasCell& cell) {
  const double exact = *what.exact, unit = what.unit > 0 ? what.unit : std::abs(exact);
  LM_CHECK(unit > 0, "{}: of what is the tolerance a share?", what.name);
  const double difference = cell.mean - exact;
  cell.energy = 1 + difference / unit;
  cell.z = z_of(difference, cell.standard_error);
  fill_in_time(cell, unit);
  const double noise = kWrongZ * cell.standard_error, bias = tolerance_of(what, cell.method) * unit;
  judge(what, cell,
        std::abs(difference) > noise + bias ? fmt::format("the mean is {:+.3g} % off", 100 * difference / unit) : "");
}

/// Compares each block and the mean.
void compare(const AtlasCase& what, const AtlasCell& other, const Samples& theirs, const Samples& ours,
             AtlasCell& cell) {
  const double tolerance = std::max(tolerance_of(what, cell.method), tolerance_of(what, other.method));
  // The excess over the stated bias, in standard errors.
  const auto beyond = [&](const Estimate& a, const Estimate& b, double blur) {
    const double difference = a.value - b.value;
    const double bias = tolerance * std::max(std::abs(a.value), std::abs(b.value)) + blur;
    return z_of(std::copysign(std::max(std::abs(difference) - bias, 0.0), difference),
                std::hypot(a.standard_error, b.standard_error));
  };
  const auto blur = [](const Samples& samples, std::size_t i) {
    return samples.block_blur.empty() ? 0 : samples.block_blur[i];
  };
  for (std::size_t i = 0; i < ours.blocks.front().size(); ++i) {
    const double z = beyond(block_of(ours, i), block_of(theirs, i), blur(ours, i) + blur(theirs, i));
    cell.z = std::abs(z) > std::abs(cell.z) ? z : cell.z;
  }
  cell.energy = cell.mean / other.mean;
  fill_in_time(cell, cell.mean);
  const double whole =
      beyond({cell.mean, cell.standard_error}, {other.mean, other.standard_error}, ours.mean_blur + theirs.mean_blur);
  std::string wrong;
  if (std::abs(cell.z) > kWrongBlockZ || std::abs(whole) > kWrongZ) {
    wrong = fmt::format("{} and {} disagree: the means by {:+.3g} %, z {:.1f}; a block by z {:.1f}", cell.method,
                        other.method, 100 * (cell.energy - 1), whole, cell.z);
  }
  judge(what, cell, wrong);
}

/// Why a method cannot find all light of this scene, or empty. `fails`: the method cannot render the scene at all.
std::string veto(const TestScene& scene, const AtlasCase& what, const std::string& method, bool& fails) {
  if (const auto made = make_method(scene.compiled(), {method, kSeed, what.max_bounces}); !made.ok()) {
    fails = true;
    return message_of(made.status());
  }
  const MeshSource meshes{[&](const Sha256& digest) { return std::optional(scene.assets()(digest).value()); }};
  const Verdict verdict = admit(read_facts(scene.scene(), meshes), method);
  return verdict.admitted ? "" : verdict.reason;
}

/// Marks a cell as slow if it is right only with more samples.
void call_slow(int more_levels, AtlasCell& cell) {
  if (cell.outcome != Outcome::wrong && more_levels > 0) {
    cell.outcome = Outcome::slow;
    cell.reason = fmt::format("looks wrong with {} times fewer samples", 1 << more_levels);
  }
}

/// Returns false if it was stopped.
bool measure_by_formula(const TestScene& scene, const AtlasCase& what, const AtlasSettings& settings, AtlasCell& cell) {
  const bool vetoed = cell.outcome == Outcome::vetoed;
  for (int more_levels = 0;; more_levels += kRetryLevels) {
    Samples samples;
    if (!render(scene, what, settings, more_levels, cell, samples)) {
      cell.outcome = vetoed ? Outcome::vetoed : Outcome::stopped;
      return false;
    }
    compare_with_formula(what, cell);
    call_slow(more_levels, cell);
    if (cell.outcome != Outcome::wrong || cell.non_finite > 0 || more_levels >= kRetryLevels * settings.retries) {
      return true;
    }
  }
}

/// Compares each method with the first other one that is admitted. Renders again with more samples where the result
/// looks wrong.
void compare_all(const TestScene& scene, const AtlasCase& what, const AtlasSettings& settings,
                 std::vector<Samples>& samples, AtlasRow& row) {
  std::vector<std::size_t> admitted;
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    if (row.cells[i].measured && row.cells[i].outcome != Outcome::vetoed) {
      admitted.push_back(i);
    }
  }
  row.expected_from = admitted.size() > 1 ? "each other" : "";
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    AtlasCell& cell = row.cells[i];
    const auto other = std::ranges::find_if(admitted, [&](std::size_t j) { return j != i; });
    if (!cell.measured) {
      continue;
    }
    if (other == admitted.end()) {
      fill_in_time(cell, cell.mean);
      cell.outcome = cell.outcome == Outcome::vetoed ? Outcome::vetoed : Outcome::alone;
      continue;
    }
    compare(what, row.cells[*other], samples[*other], samples[i], cell);
    for (int retry = 1; retry <= settings.retries && cell.outcome == Outcome::wrong && cell.non_finite == 0; ++retry) {
      AtlasCell again;
      again.method = cell.method;
      Samples more;
      if (!render_blocks(scene, what, settings, retry * kRetryLevels, again, more)) {
        return;
      }
      compare(what, row.cells[*other], samples[*other], more, again);
      call_slow(retry * kRetryLevels, again);
      cell = std::move(again);
    }
  }
}

void refuse(const AtlasCase& what, AtlasRow& row) {
  const std::string message = refusal(what.document, what.files, read_image);
  row.expected_from = "a refusal";
  for (AtlasCell& cell : row.cells) {
    const bool refused = message.find(what.refusal) != std::string::npos;
    cell.outcome = refused ? Outcome::vetoed : Outcome::wrong;
    cell.reason = refused ? message : message.empty() ? "the scene is accepted" : "refused otherwise: " + message;
  }
}

}  // namespace

const char* name_of(Outcome outcome) {
  switch (outcome) {
    case Outcome::right:
      return "right";
    case Outcome::slow:
      return "slow";
    case Outcome::alone:
      return "alone";
    case Outcome::vetoed:
      return "vetoed";
    case Outcome::wrong:
      return "wrong";
    case Outcome::stopped:
      return "stopped";
  }
  LM_CHECK(false, "an outcome");
}

std::vector<std::string> atlas_methods() {
  return {"path", "caustic", "vcm", "ppm", "whitted", "raycast"};
}

AtlasRow measure(const AtlasCase& what, const AtlasSettings& settings) {
  AtlasRow row{what, what.exact.value_or(0), what.exact ? "a formula" : "", {}};
  for (const std::string& method : settings.methods) {
    row.cells.emplace_back().method = method;
  }
  if (!what.refusal.empty()) {
    refuse(what, row);
    return row;
  }
  const TestScene scene = scene_of(what, read_image);
  std::vector<Samples> samples(row.cells.size());
  for (std::size_t i = 0; i < row.cells.size(); ++i) {
    AtlasCell& cell = row.cells[i];
    bool fails = false;
    cell.reason = veto(scene, what, cell.method, fails);
    if (!cell.reason.empty()) {
      cell.outcome = Outcome::vetoed;
      if (fails || !settings.measure_vetoed) {
        continue;
      }
    }
    const bool done = what.exact ? measure_by_formula(scene, what, settings, cell)
                                 : render_blocks(scene, what, settings, 0, cell, samples[i]);
    if (!done) {
      return row;
    }
  }
  if (!what.exact) {
    compare_all(scene, what, settings, samples, row);
  }
  return row;
}

}  // namespace lightmill::test

// The failure atlas as a map: every case by every method, measured and judged.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "common/methods/method.h"
#include "tests/atlas/cases/atlas_case.h"

namespace lightmill::test {

enum class Outcome {
  right,
  slow,     ///< right, but an error of 1 % takes more CPU time than the case allows
  alone,    ///< admitted, without a formula or another method that finds all light
  vetoed,   ///< the planner names what is missing, or the method or the scene is refused
  wrong,    ///< admitted, and off by more than noise and the stated bias
  stopped,  ///< stopped before it was measured
};
/// "right", "slow" …
const char* name_of(Outcome outcome);

/// One case by one method.
struct AtlasCell {
  std::string method;
  Outcome outcome = Outcome::stopped;
  std::string reason;  ///< of a veto or a wrong result
  bool measured = false;
  double mean = 0, standard_error = 0;  ///< of all seeds, over what the case measures
  double z = 0;                         ///< of the mean, or in comparisons the largest of any block; ±kMaxZ
  double energy = 1;                    ///< the mean over the expected value
  double cpu_seconds = 0;               ///< of all seeds
  double seconds_to_percent = 0;        ///< of CPU time, extrapolated by 1/N
  std::uint64_t non_finite = 0;         ///< samples
  RgbImage picture;                     ///< the mean over seeds
};

struct AtlasRow {
  AtlasCase what;
  double expected = 0;
  std::string expected_from;  ///< "a formula", "caustic"
  std::vector<AtlasCell> cells;
};

struct AtlasSettings {
  std::vector<std::string> methods;
  int seeds = 32;
  int more_levels = 0;          ///< added to log2 of the samples of each seed, which stays at least 1
  bool measure_vetoed = false;  ///< also measures what the planner vetoes
  /// The number of times that a result is measured again if it looks wrong, with 16 times the samples each time. If it then looks
  /// right, it is slow.
  int retries = 0;
  /// Once it is set, the remaining cells are not measured.
  const std::atomic<bool>* stop = nullptr;
};

/// Methods that the atlas measures: all that follow light.
std::vector<std::string> atlas_methods();

/// Renders a case by each method in this thread. The same settings give the same means.
AtlasRow measure(const AtlasCase& what, const AtlasSettings& settings);

// A mean is wrong if it is off by more than the case's tolerance plus kWrongZ of its standard errors. Means of 32 seeds
// are nearly normal, so |z| > 5 happens by chance once in 50,000, or once in 250 maps of 200 means. The seeds are
// fixed, so a map that passes stays so. A comparison of two methods takes the largest of 192 block means (about 62
// degrees of freedom). There |z| > 6 happens once in 50,000 comparisons.
inline constexpr double kWrongZ = 5;
inline constexpr double kWrongBlockZ = 6;
inline constexpr double kMaxZ = 1e6;

}  // namespace lightmill::test

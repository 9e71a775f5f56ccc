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
  alone,    ///< admitted, and nothing to compare it with: no formula, and no other method finds all light
  vetoed,   ///< the planner says what is missing, or the method or the scene is refused
  wrong,    ///< admitted, and off by more than noise and the stated bias
  stopped,  ///< before it was measured
};
/// "right", "slow" …
const char* name_of(Outcome outcome);

/// One case by one method.
struct AtlasCell {
  std::string method;
  Outcome outcome = Outcome::stopped;
  std::string reason;  ///< of a veto; what is wrong
  bool measured = false;
  double mean = 0, standard_error = 0;  ///< of all seeds, over what the case measures
  double z = 0;                         ///< of the mean; where methods are compared, the largest of any block; ±kMostZ
                                        ///< at most
  double energy = 1;                    ///< the mean over what it should be
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
  int more_levels = 0;          ///< to log2 of the samples of each seed; it stays at least 1
  bool measure_vetoed = false;  ///< also what the planner vetoes
  /// What looks wrong is measured again with 16 times the samples, so often at most: if it looks right then, it is
  /// slow.
  int retries = 0;
  /// Set: what is not measured yet is left as it is.
  const std::atomic<bool>* stop = nullptr;
};

/// Methods that the atlas measures: those that follow light, of those that there are.
std::vector<std::string> atlas_methods();

/// Renders a case by each method in this thread. The same settings give the same means.
AtlasRow measure(const AtlasCase& what, const AtlasSettings& settings);

// A mean is wrong if it is off by more than the case's tolerance and kWrongZ of its standard errors together. Of 32
// seeds, whose means are nearly normal, |z| > 5 comes by chance once in 50,000 times, in a map of 200 means once in 250
// maps; the seeds are fixed, so a map that is right stays so. Where two methods are compared, the largest of 192 block
// means (some 62 degrees of freedom): |z| > 6 comes once in 50,000 comparisons.
inline constexpr double kWrongZ = 5;
inline constexpr double kWrongBlockZ = 6;
inline constexpr double kMostZ = 1e6;

}  // namespace lightmill::test

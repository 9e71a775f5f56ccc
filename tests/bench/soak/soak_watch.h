// Resources of a soak's processes over time, and whether they grow.
#pragma once

#include <sys/types.h>

#include <array>
#include <map>
#include <string>
#include <vector>

namespace lightmill::soak {

/// The longest life of a process, and its resources in each third of it. Each third is the 10th percentile of
/// its samples. Temporary use varies with the load, and a leak stays.
struct Trend {
  double seconds = 0;
  std::array<double, 3> memory_mib{};   ///< resident
  std::array<double, 3> descriptors{};  ///< open files and sockets
  double most_mib = 0;                  ///< resident, at any moment
  /// Lives below kMinSeconds are too short to judge.
  bool judged() const { return seconds >= kMinSeconds; }
  /// At most four more descriptors in the last third than in the middle one, and a tenth and 16 MiB more memory. The
  /// memory of shorter lives than kSecondsToFill does not count: workers are still filling their caches of scenes.
  bool flat() const {
    const bool is_full = seconds >= kSecondsToFill;
    return (!is_full || memory_mib[2] <= 1.1 * memory_mib[1] + 16) && descriptors[2] <= descriptors[1] + 4;
  }
  static constexpr double kMinSeconds = 240, kSecondsToFill = 1800;
};

class ProcessWatch {
 public:
  /// Samples the process of this name. A new pid starts a new life.
  void sample(const std::string& name, pid_t pid, double now_seconds);
  std::map<std::string, Trend> trends() const;

 private:
  struct Sample {
    double seconds, memory_mib, descriptors;
  };
  struct Life {
    pid_t pid = 0;
    std::vector<Sample> samples;
    double seconds() const { return samples.empty() ? 0 : samples.back().seconds - samples.front().seconds; }
  };
  std::map<std::string, std::vector<Life>> lives_;
};

}  // namespace lightmill::soak

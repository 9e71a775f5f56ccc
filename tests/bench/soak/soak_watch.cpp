#include "tests/bench/soak/soak_watch.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace lightmill::soak {
namespace {

double resident_mib(pid_t pid) {
  std::ifstream file(fmt::format("/proc/{}/statm", pid));
  double all = 0, resident = 0;
  file >> all >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

double open_descriptors(pid_t pid) {
  std::error_code gone;
  const std::filesystem::directory_iterator all(fmt::format("/proc/{}/fd", pid), gone);
  return gone ? 0 : static_cast<double>(std::distance(begin(all), end(all)));
}

/// The value below which a tenth of them lies.
double lowest_tenth(std::vector<double> values) {
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 10);
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

void ProcessWatch::sample(const std::string& name, pid_t pid, double now_seconds) {
  std::vector<Life>& lives = lives_[name];
  if (lives.empty() || lives.back().pid != pid) {
    lives.push_back({pid, {}});
  }
  if (const double memory_mib = resident_mib(pid); memory_mib > 0) {  // false if the process has just ended
    lives.back().samples.push_back({now_seconds, memory_mib, open_descriptors(pid)});
  }
}

std::map<std::string, Trend> ProcessWatch::trends() const {
  std::map<std::string, Trend> trends;
  for (const auto& [name, lives] : lives_) {
    const Life& longest = *std::ranges::max_element(lives, {}, &Life::seconds);
    Trend& trend = trends[name];
    trend.seconds = longest.seconds();
    const std::size_t third = longest.samples.size() / 3;
    for (std::size_t part = 0; third > 0 && part < 3; ++part) {
      std::vector<double> memory, descriptors;
      for (std::size_t i = part * third; i < (part + 1) * third; ++i) {
        memory.push_back(longest.samples[i].memory_mib);
        descriptors.push_back(longest.samples[i].descriptors);
        trend.most_mib = std::max(trend.most_mib, longest.samples[i].memory_mib);
      }
      trend.memory_mib[part] = lowest_tenth(std::move(memory));
      trend.descriptors[part] = lowest_tenth(std::move(descriptors));
    }
  }
  return trends;
}

}  // namespace lightmill::soak

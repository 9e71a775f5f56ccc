// Notices of a reader, each once.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

/// A list of what was left out or assumed. Texts may come from a file, so their number is limited.
class Notices {
 public:
  static constexpr std::size_t kMax = 1'000;

  /// `list` must outlive it. Others may add to it.
  explicit Notices(std::vector<std::string>& list) : list_(list) {}
  void once(std::string notice) {
    if (said_.size() < kMax && said_.insert(notice).second) {
      list_.push_back(std::move(notice));
      if (said_.size() == kMax) {
        list_.emplace_back("further notices are not listed");
      }
    }
  }
  void left_out(std::string_view what) { once(fmt::format("left out: {}", what)); }

 private:
  std::vector<std::string>& list_;
  std::set<std::string> said_;
};

}  // namespace lightmill

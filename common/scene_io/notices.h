// Notices of a reader, each once.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

/// A list of what was left out or assumed.
class Notices {
 public:
  /// `list` must outlive it.
  explicit Notices(std::vector<std::string>& list) : list_(list) {}
  void once(std::string notice) {
    if (std::find(list_.begin(), list_.end(), notice) == list_.end()) {
      list_.push_back(std::move(notice));
    }
  }
  void left_out(std::string_view what) { once(fmt::format("left out: {}", what)); }

 private:
  std::vector<std::string>& list_;
};

}  // namespace lightmill

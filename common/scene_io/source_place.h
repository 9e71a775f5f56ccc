// A place in a text file, for messages.
#pragma once

#include <string>

#include "common/base/status.h"
#include "common/base/text.h"

namespace lightmill {

/// A line of a file. The name must outlive it.
struct SourcePlace {
  const std::string* file = nullptr;
  int line = 0;  ///< from 1

  std::string text() const { return fmt::format("{}:{}", *file, line); }
  /// "scene.pbrt:12: …". It is cut, because a quoted word may have any length.
  template <class... Args>
  Status error(fmt::format_string<Args...> format, Args&&... args) const {
    return invalid_argument("{}: {}", text(),
                            cut_text(printable(fmt::format(format, std::forward<Args>(args)...)), 300));
  }
};

}  // namespace lightmill

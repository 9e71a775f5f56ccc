// Faults of a scene's files that do not stop its loading.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/status.h"

namespace lightmill {

/// A list of faults with their places and remedies. Faults of one kind share one notice, so the list stays short.
class Faults {
 public:
  static constexpr std::size_t kMaxKinds = 100;  ///< that are named

  /// `fault` begins with its place: "box.obj:12: …". `remedy` says what is done instead, in lower case: "the face is
  /// skipped". Both may contain any bytes.
  void add(std::string_view kind, std::string_view fault, std::string_view remedy);

  bool empty() const { return kinds_.empty(); }
  /// Whether the text of another fault of this kind would be used: it is the first, and not too many kinds are named.
  bool needs_text(std::string_view kind) const { return kinds_.size() < kMaxKinds && !index_.contains(kind); }
  /// One for each kind, in the order of the first: "box.obj:12: f: …. The face is skipped (and 3 more like it)".
  std::vector<std::string> notices() const;
  /// The first fault as an error.
  Status as_error() const;

 private:
  struct Kind {
    std::string fault, remedy;
    std::size_t others = 0;
  };
  std::vector<Kind> kinds_;
  std::map<std::string, std::size_t, std::less<>> index_;  ///< in kinds_
  std::size_t beyond_ = 0;                                 ///< faults of further kinds
};

}  // namespace lightmill

#include "common/base/suggestion.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "common/base/text.h"

namespace lightmill {
namespace {

/// The number of letters to insert, remove, replace or swap with their neighbour to turn `a` into `b` (optimal string
/// alignment).
std::size_t distance_of(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  std::iota(last.begin(), last.end(), 0);
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        row[j] = std::min(row[j], before[j - 2] + 1);
      }
    }
    before = std::exchange(last, row);
  }
  return last[b.size()];
}

}  // namespace

std::string did_you_mean(std::string_view word, const std::vector<std::string>& words) {
  std::string_view nearest;
  if (word.starts_with('-') && word.size() == 2) {
    return "";  // every option of one letter is near
  }
  std::size_t least = std::max<std::size_t>(word.size() / 3, 1) + 1;
  for (const std::string& each : words) {
    if (word.size() >= each.size() + least) {
      continue;  // far away, and words from the network may be long
    }
    if (const std::size_t distance = distance_of(word, each); distance < least) {
      nearest = each;
      least = distance;
    }
  }
  return nearest.empty() ? "" : fmt::format(". Did you mean '{}'?", nearest);
}

std::string unknown_text(std::string_view kind, std::string_view word, const std::vector<std::string>& known) {
  const std::string near = did_you_mean(word, known);
  return fmt::format("unknown {} '{}'{} Known {}s: {}", kind, printable(word), near.empty() ? "." : near, kind,
                     fmt::join(known, ", "));
}

}  // namespace lightmill

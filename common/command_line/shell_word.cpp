#include "common/command_line/shell_word.h"

#include <algorithm>
#include <cctype>
#include <string_view>

namespace lightmill {

std::string shell_word(const std::string& word) {
  constexpr std::string_view kPlain = "_./:@%+=,-";
  const bool plain = !word.empty() && std::ranges::all_of(word, [&](unsigned char c) {
    return std::isalnum(c) != 0 || kPlain.find(static_cast<char>(c)) != kPlain.npos;
  });
  std::string quoted = "'";
  for (const char c : word) {
    quoted += c == '\'' ? "'\\''" : std::string(1, c);
  }
  return plain ? word : quoted + "'";
}

}  // namespace lightmill

#include "tests/fuzz/mutate.h"

#include <algorithm>
#include <cstdlib>

namespace lightmill {
namespace {

/// A random stretch of the text, mostly short.
std::pair<std::size_t, std::size_t> pick_range(const std::string& text, FuzzRandom& random) {
  if (text.empty()) {
    return {0, 0};
  }
  const std::size_t begin = random.below(text.size());
  const std::size_t longest =
      random.below(8) == 0 ? text.size() - begin : std::min<std::size_t>(text.size() - begin, 12);
  return {begin, 1 + random.below(std::max<std::size_t>(longest, 1))};
}

void edit(std::string& text, std::span<const std::string_view> words, FuzzRandom& random) {
  const auto [begin, length] = pick_range(text, random);
  const std::string_view word = words[random.below(words.size())];
  switch (random.below(8)) {
    case 0:  // one bit
      if (!text.empty()) {
        text[begin] = static_cast<char>(text[begin] ^ (1 << random.below(8)));
      }
      break;
    case 1:  // one byte
      if (!text.empty()) {
        text[begin] = static_cast<char>(random.below(256));
      }
      break;
    case 2:
      text.erase(begin, length);
      break;
    case 3:
      text.insert(begin, text.substr(begin, length));
      break;
    case 4:
      text.insert(random.below(text.size() + 1), text.substr(begin, length));
      break;
    case 5:
      text.insert(begin, word);
      break;
    case 6:
      text.replace(begin, std::min(length, text.size() - begin), word);
      break;
    case 7:
      if (random.below(8) == 0) {
        text.resize(begin);
      }
      break;
  }
}

}  // namespace

std::uint64_t FuzzRandom::next() {
  std::uint64_t z = state_ += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  return z ^ (z >> 31);
}

int fuzz_cases(int usual) {
  const char* const asked = std::getenv("LIGHTMILL_FUZZ_CASES");
  return asked == nullptr ? usual : std::max(usual, std::atoi(asked));
}

std::string mutate(std::string_view original, std::span<const std::string_view> words, FuzzRandom& random) {
  std::string text(original);
  for (std::size_t edits = 1 + random.below(8); edits > 0; --edits) {
    edit(text, words, random);
  }
  return text;
}

}  // namespace lightmill

#include "common/base/text_width.h"

#include <sys/ioctl.h>
#include <unistd.h>
#include <wchar.h>

#include <clocale>

namespace lightmill {
namespace {

/// The C library's tables for Unicode, whatever locale the user has. Without them (a system that lacks C.UTF-8) each
/// character counts as one column.
class UnicodeTables {
 public:
  UnicodeTables() {
    static const locale_t unicode = ::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
    before_ = ::uselocale(unicode);
  }
  ~UnicodeTables() { ::uselocale(before_); }
  UnicodeTables(const UnicodeTables&) = delete;
  UnicodeTables& operator=(const UnicodeTables&) = delete;

 private:
  locale_t before_ = nullptr;
};

struct Cell {
  std::size_t bytes = 1;
  int columns = 1;
};

bool continues_character(char byte) {
  return (static_cast<unsigned char>(byte) & 0xc0) == 0x80;
}

/// The first cell of `text`, which is not empty.
Cell first_cell(std::string_view text) {
  Cell first;
  while (first.bytes < text.size() && continues_character(text[first.bytes])) {
    ++first.bytes;
  }
  wchar_t code = 0;
  std::mbstate_t state{};
  if (first.bytes > 1 && ::mbrtowc(&code, text.data(), first.bytes, &state) == first.bytes) {
    const int columns = ::wcwidth(code);
    first.columns = columns < 0 ? 1 : columns;  // a character newer than the tables
  }
  return first;
}

}  // namespace

int terminal_columns(int descriptor) {
  winsize size{};
  return ::isatty(descriptor) == 1 && ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

int columns_of(std::string_view text) {
  const UnicodeTables tables;
  int columns = 0;
  while (!text.empty()) {
    const Cell first = first_cell(text);
    columns += first.columns;
    text.remove_prefix(first.bytes);
  }
  return columns;
}

int widest_word(std::string_view text) {
  int widest = 0;
  while (!text.empty()) {
    const std::string_view word = text.substr(0, text.find(' '));
    widest = std::max(widest, columns_of(word));
    text.remove_prefix(std::min(word.size() + 1, text.size()));
  }
  return widest;
}

std::string cut_to_columns(std::string_view text, int columns) {
  const UnicodeTables tables;
  std::size_t end = 0;
  while (end < text.size()) {
    const Cell next = first_cell(text.substr(end));
    columns -= next.columns;
    if (columns < 0) {
      break;
    }
    end += next.bytes;
  }
  constexpr std::string_view kJoiner = "\u200d";  // at the end it would join what comes after the text
  while (end < text.size() && text.substr(0, end).ends_with(kJoiner)) {
    end -= kJoiner.size();
  }
  return std::string(text.substr(0, end));
}

std::vector<std::string> wrap_to_columns(std::string_view text, int columns) {
  std::vector<std::string> lines(1);
  int used = 0;  // columns of the last line
  while (!text.empty()) {
    const std::size_t spaces = std::min(text.find_first_not_of(' '), text.size());
    std::string_view word = text.substr(spaces, text.find(' ', spaces) - spaces);
    text.remove_prefix(spaces + word.size());
    const int gap = lines.back().empty() && lines.size() > 1 ? 0 : static_cast<int>(spaces);
    if (used > 0 && used + gap + columns_of(word) > columns) {
      lines.emplace_back();
      used = 0;
    } else {
      lines.back().append(static_cast<std::size_t>(gap), ' ');
      used += gap;
    }
    while (columns_of(word) > columns - used) {
      const std::string part = cut_to_columns(word, columns - used);
      lines.back() += part;
      word.remove_prefix(part.size());
      lines.emplace_back();
      used = 0;
    }
    lines.back() += word;
    used += columns_of(word);
  }
  return lines;
}

}  // namespace lightmill

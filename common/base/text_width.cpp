#include "common/base/text_width.h"

#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>
#include <wchar.h>

#include <algorithm>
#include <array>
#include <clocale>
#include <cstdlib>

#include "common/base/text.h"

namespace lightmill {
namespace {

constexpr int kMinWrappedColumns = 20, kMaxColumns = 10'000;

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

std::string_view variable(const char* name) {
  const char* const value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Whether TERM names a terminal that obeys control sequences.
bool obeys_codes() {
  return !variable("TERM").empty() && variable("TERM") != "dumb";
}

constexpr std::array<std::string_view, 12> kUnits{"s",  "min", "h", "ms",  "d",   "days",
                                                  "kB", "B",   "%", "KiB", "MiB", "GiB"};

/// The end of the word that begins at `from`.
std::size_t end_from(std::string_view text, std::size_t from) {
  return std::min(text.find(' ', from), text.size());
}

/// The end of a number with its unit, such as "10 min". 0 if the first word is no number, or has no unit.
std::size_t end_of_quantity(std::string_view text) {
  const std::size_t end = end_from(text, 0);
  if (end == 0 || end == text.size() || text[end - 1] < '0' || text[end - 1] > '9') {
    return 0;
  }
  const std::size_t whole = end_from(text, end + 1);
  const std::string_view unit = text.substr(end + 1, text.find_first_of(" .,;:)", end + 1) - end - 1);
  return std::ranges::find(kUnits, unit) == kUnits.end() ? 0 : whole;
}

/// The end of the first word: a word, a number with its unit, or in a sentence also a command in backticks, or the
/// beginning of a default.
std::size_t end_of_word(std::string_view text, int columns, bool sentence) {
  const auto blank = [&](std::size_t from) { return end_from(text, from); };
  const std::size_t end = blank(0);
  std::size_t whole = std::max(end, end_of_quantity(text));
  if (!sentence) {
    return columns_of(text.substr(0, whole)) <= columns ? whole : end;
  }
  if (const std::size_t quote = text.substr(0, end).rfind('`'); quote != std::string_view::npos) {
    const bool opens = std::ranges::count(text.substr(0, end), '`') % 2 == 1;
    const std::size_t closing = opens ? text.find('`', quote + 1) : quote;
    whole = closing == std::string_view::npos ? end : blank(closing);
  } else if (text.substr(0, end).ends_with("(default:")) {
    whole = end == text.size() ? end : blank(std::min(text.find_first_of(",)", end), text.size()));
  }
  return columns_of(text.substr(0, whole)) <= columns ? whole : end;
}

std::vector<std::string> wrap(std::string_view text, int columns, bool sentences) {
  std::vector<std::string> lines(1);
  int used = 0;  // columns of the last line
  while (!text.empty()) {
    const std::size_t spaces = std::min(text.find_first_not_of(' '), text.size());
    std::string_view word = text.substr(spaces);
    word = word.substr(0, end_of_word(word, columns, sentences));
    text.remove_prefix(spaces + word.size());
    const int gap = lines.back().empty() && lines.size() > 1 ? 0 : static_cast<int>(spaces);
    if (used > 0 && used + gap + columns_of(word) > columns) {
      lines.emplace_back();
      used = 0;
    } else {
      lines.back().append(static_cast<std::size_t>(gap), ' ');
      used += gap;
    }
    while (!sentences && columns_of(word) > columns - used) {
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

}  // namespace

int terminal_columns(int descriptor) {
  winsize size{};
  return ::isatty(descriptor) == 1 && ::ioctl(descriptor, TIOCGWINSZ, &size) == 0 ? size.ws_col : 0;
}

int output_columns(int descriptor) {
  const int given = parse_number<int>(variable("COLUMNS")).value_or(0);
  return given >= kMinWrappedColumns && given <= kMaxColumns ? given : terminal_columns(descriptor);
}

bool can_redraw(int descriptor) {
  return ::isatty(descriptor) == 1 && obeys_codes();
}

bool colors_wanted() {
  return variable("NO_COLOR").empty() && obeys_codes();
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
  return wrap(text, columns, false);
}

std::vector<std::string> wrap_sentences(std::string_view text, int columns) {
  return wrap(text, columns, true);
}

std::string wrap_lines(std::string_view text, int columns) {
  if (columns < kMinWrappedColumns) {
    return std::string(text);
  }
  std::string lines;
  for (;;) {
    const std::string_view line = text.substr(0, text.find('\n'));
    lines += fmt::format("{}", fmt::join(wrap_sentences(line, columns), "\n"));
    if (line.size() == text.size()) {
      return lines;
    }
    lines += '\n';
    text.remove_prefix(line.size() + 1);
  }
}

}  // namespace lightmill

#include "common/scene_io/statement_reader.h"

#include <charconv>
#include <cmath>

namespace lightmill {
namespace {

bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f';
}

std::string_view trim(std::string_view text) {
  while (!text.empty() && is_blank(text.front())) {
    text.remove_prefix(1);
  }
  while (!text.empty() && is_blank(text.back())) {
    text.remove_suffix(1);
  }
  return text;
}

std::string_view without_comment(std::string_view line) {
  for (std::size_t hash = line.find('#'); hash != std::string_view::npos; hash = line.find('#', hash + 1)) {
    if (hash == 0 || is_blank(line[hash - 1])) {
      return line.substr(0, hash);
    }
  }
  return line;
}

}  // namespace

std::string_view StatementReader::take_line() {
  const auto take_to = [](char end, std::string_view& from) {
    const std::size_t at = from.find(end);
    const std::string_view taken = from.substr(0, at);
    from.remove_prefix(at == std::string_view::npos ? from.size() : at + 1);
    return taken;
  };
  if (piece_.empty()) {
    piece_ = take_to('\n', text_);
  }
  const std::string_view line = take_to('\r', piece_);
  ++line_;
  return trim(without_comment(line));
}

std::optional<Statement> StatementReader::next() {
  while (!at_end()) {
    statement_line_ = line_ + 1;
    std::string_view line = take_line();
    if (line.ends_with('\\')) {
      joined_.clear();
      while (line.ends_with('\\')) {
        joined_.append(line.substr(0, line.size() - 1)).push_back(' ');
        line = at_end() ? std::string_view() : take_line();
      }
      joined_.append(line);
      line = trim(joined_);
    }
    if (!line.empty()) {
      const std::string_view keyword = take_word(line);
      return Statement{keyword, trim(line), statement_line_};
    }
  }
  return std::nullopt;
}

std::string_view take_word(std::string_view& text) {
  std::size_t begin = 0;
  while (begin < text.size() && is_blank(text[begin])) {
    ++begin;
  }
  std::size_t end = begin;
  while (end < text.size() && !is_blank(text[end])) {
    ++end;
  }
  const std::string_view word = text.substr(begin, end - begin);
  text.remove_prefix(end);
  return word;
}

std::optional<double> parse_number(std::string_view word) {
  if (word.starts_with('+') && !word.starts_with("+-")) {
    word.remove_prefix(1);
  }
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error == std::errc::result_out_of_range && end == word.data() + word.size()) {
    // Too small numbers count as zero. Too large ones are refused.
    const std::size_t exponent = word.find_first_of("eE");
    return exponent != std::string_view::npos && word.substr(exponent + 1).starts_with('-') ? std::optional(0.0)
                                                                                            : std::nullopt;
  }
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
    return std::nullopt;
  }
  return value;
}

}  // namespace lightmill

// Wavefront's text files, statement by statement, with the place of every mistake.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/base/text.h"

namespace lightmill {

/// One statement: a keyword and what follows it, comments and line ends removed.
struct Statement {
  std::string_view keyword;
  std::string_view rest;  ///< without blanks at its ends
  int line = 0;           ///< from 1; of the statement's first line
};

/// Cuts a text into statements. A UTF-8 byte order mark before them is passed over. Lines end with LF or CRLF, a
/// backslash at the end of a line continues it, and a comment goes from a # at the beginning of a word to the end of
/// the line. The views live as long as the text and until the next call of next().
class StatementReader {
 public:
  /// `file_name` is for messages.
  StatementReader(std::string_view text, std::string file_name)
      : text_(text.substr(text.starts_with("\xef\xbb\xbf") ? 3 : 0)), file_name_(std::move(file_name)) {}

  /// The next statement; nothing at the end.
  std::optional<Statement> next();

  const std::string& file_name() const { return file_name_; }
  /// An error at the line of the last statement: "box.obj:12: …". A word that it quotes may have any length, so it is
  /// cut.
  template <class... Args>
  Status error(fmt::format_string<Args...> format, Args&&... args) const {
    return invalid_argument("{}:{}: {}", file_name_, statement_line_,
                            cut_text(fmt::format(format, std::forward<Args>(args)...), kMostErrorBytes));
  }
  int line() const { return statement_line_; }

 private:
  static constexpr std::size_t kMostErrorBytes = 300;
  std::string_view take_line();

  std::string_view text_;
  std::string file_name_;
  std::string joined_;  ///< a statement of several lines
  int line_ = 0;        ///< lines taken so far
  int statement_line_ = 0;
};

/// Takes the next word, up to a blank; empty at the end.
std::string_view take_word(std::string_view& text);

/// Reads a whole word as a finite number; nothing if it is none.
std::optional<double> parse_number(std::string_view word);

/// Reads a whole word as an integer; nothing if it is none, or beyond 64 bits.
std::optional<std::int64_t> parse_integer(std::string_view word);

/// A name as it may stand in a scene: bytes that are not UTF-8 are written as \xHH.
std::string utf8_name(std::string_view name);

}  // namespace lightmill

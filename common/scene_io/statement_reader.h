// Reader of Wavefront's text files, statement by statement. Every error has its place.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "common/base/text.h"

namespace lightmill {

/// One statement: a keyword and the rest, without comments and line ends.
struct Statement {
  std::string_view keyword;
  std::string_view rest;  ///< without blanks at its ends
  int line = 0;           ///< from 1; of the statement's first line
};

/// Cuts a text into statements. A leading UTF-8 byte order mark is skipped. Lines end with LF, CRLF or CR. A backslash
/// at the end of a line continues it. A comment goes from a # at the beginning of a word to the end of the line. The
/// views are valid until the next call of next(), and no longer than the text.
class StatementReader {
 public:
  /// `file_name` is for messages.
  StatementReader(std::string_view text, std::string file_name)
      : text_(text.substr(text.starts_with("\xef\xbb\xbf") ? 3 : 0)), file_name_(std::move(file_name)) {}

  /// The next statement. Nothing at the end.
  std::optional<Statement> next();

  const std::string& file_name() const { return file_name_; }
  /// An error at the line of the last statement: "box.obj:12: …". It is cut, because a quoted word may have any length.
  template <class... Args>
  Status error(fmt::format_string<Args...> format, Args&&... args) const {
    return invalid_argument("{}:{}: {}", file_name_, statement_line_,
                            cut_text(fmt::format(format, std::forward<Args>(args)...), kMaxErrorBytes));
  }
  int line() const { return statement_line_; }

 private:
  static constexpr std::size_t kMaxErrorBytes = 300;
  std::string_view take_line();
  bool at_end() const { return text_.empty() && piece_.empty(); }

  std::string_view text_;
  std::string_view piece_;  ///< what is left up to the LF before text_; CRs cut it
  std::string file_name_;
  std::string joined_;  ///< a statement with several lines
  int line_ = 0;        ///< lines taken so far
  int statement_line_ = 0;
};

/// Takes the next word, up to a blank. Empty at the end.
std::string_view take_word(std::string_view& text);

/// Reads a whole word as a finite number. Nothing if it is not one.
std::optional<double> parse_number(std::string_view word);

}  // namespace lightmill

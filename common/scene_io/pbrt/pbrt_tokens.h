// Tokens of a pbrt file, with their lines.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/scene_io/source_place.h"

namespace lightmill {

struct PbrtToken {
  std::string_view text;  ///< without quotes
  bool quoted = false;
  int line = 0;
};

/// Cuts a file into words, quoted strings and brackets. Comments go from # to the end of the line. The views of a token
/// are valid until the next one is taken.
class PbrtTokens {
 public:
  /// `file` is for messages, and must outlive this.
  PbrtTokens(std::string text, const std::string& file) : text_(std::move(text)), file_(&file) {}
  PbrtTokens(const PbrtTokens&) = delete;
  PbrtTokens& operator=(const PbrtTokens&) = delete;

  /// Nothing at the end, or after an error.
  std::optional<PbrtToken> next();
  /// The one that next() will give.
  const std::optional<PbrtToken>& peek();
  const Status& status() const { return status_; }
  SourcePlace place() const { return {file_, line_}; }
  SourcePlace place_of(const PbrtToken& token) const { return {file_, token.line}; }

  static constexpr std::size_t kMaxQuotedBytes = 200, kMaxFileNameBytes = 4096;
  /// The next token, which must be a quoted string of at most so many bytes.
  Result<std::string> string(std::string_view what, std::size_t most_bytes = kMaxQuotedBytes);
  /// Takes as many numbers as there is room for. They may be in brackets.
  Status numbers(std::span<double> out);

 private:
  std::optional<PbrtToken> scan();
  std::optional<PbrtToken> scan_string(int line);

  std::string text_;
  const std::string* file_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::string unescaped_;
  bool peeked_ = false;
  std::optional<PbrtToken> ahead_;
  Status status_;
};

}  // namespace lightmill

#include "common/scene_io/pbrt/pbrt_tokens.h"

#include <algorithm>

#include "common/scene_io/statement_reader.h"

namespace lightmill {

std::optional<PbrtToken> PbrtTokens::next() {
  if (peeked_) {
    peeked_ = false;
    return ahead_;
  }
  return scan();
}

const std::optional<PbrtToken>& PbrtTokens::peek() {
  if (!peeked_) {
    ahead_ = scan();
    peeked_ = true;
  }
  return ahead_;
}

std::optional<PbrtToken> PbrtTokens::scan() {
  constexpr std::string_view kEndsWord = " \t\r\n\"[]";
  while (status_.ok() && at_ < text_.size()) {
    const char c = text_[at_];
    if (c == '\n') {
      ++line_;
      ++at_;
    } else if (c == ' ' || c == '\t' || c == '\r') {
      ++at_;
    } else if (c == '#') {
      at_ = std::min(text_.find_first_of("\r\n", at_), text_.size());
    } else if (c == '"') {
      return scan_string(line_);
    } else {
      const std::size_t end =
          c == '[' || c == ']' ? at_ + 1 : std::min(text_.find_first_of(kEndsWord, at_), text_.size());
      const std::string_view word = std::string_view(text_).substr(at_, end - at_);
      at_ = end;
      return PbrtToken{word, false, line_};
    }
  }
  return std::nullopt;
}

std::optional<PbrtToken> PbrtTokens::scan_string(int line) {
  const std::size_t begin = ++at_;
  bool escaped = false;
  while (at_ < text_.size() && text_[at_] != '"' && text_[at_] != '\n') {
    escaped = escaped || text_[at_] == '\\';
    at_ += text_[at_] == '\\' ? 2 : 1;
  }
  if (at_ >= text_.size() || text_[at_] != '"') {
    status_ = SourcePlace{file_, line}.error("a string must end on its line, with \"");
    return std::nullopt;
  }
  const std::string_view raw = std::string_view(text_).substr(begin, at_++ - begin);
  if (!escaped) {
    return PbrtToken{raw, true, line};
  }
  unescaped_.clear();
  for (std::size_t i = 0; i < raw.size(); ++i) {
    if (raw[i] != '\\') {
      unescaped_ += raw[i];
      continue;
    }
    constexpr std::string_view kCodes = "bfnrt\\'\"", kMeanings = "\b\f\n\r\t\\'\"";
    const std::size_t code = kCodes.find(raw[++i]);
    if (code == std::string_view::npos) {
      status_ = SourcePlace{file_, line}.error("unknown escape \\{}", raw[i]);
      return std::nullopt;
    }
    unescaped_ += kMeanings[code];
  }
  return PbrtToken{unescaped_, true, line};
}

Result<std::string> PbrtTokens::string(std::string_view what, std::size_t most_bytes) {
  const std::optional<PbrtToken> token = next();
  LM_RETURN_IF_ERROR(status_);
  if (!token || !token->quoted) {
    return place().error("{} in quotes is expected, got {}", what, token ? token->text : "the end of the file");
  }
  if (token->text.size() > most_bytes) {
    return place().error("{} may have at most {} bytes", what, most_bytes);
  }
  return std::string(token->text);
}

Status PbrtTokens::numbers(std::span<double> out) {
  const bool list = peek() && !peek()->quoted && peek()->text == "[";
  if (list) {
    next();
  }
  for (double& value : out) {
    const std::optional<PbrtToken> token = next();
    LM_RETURN_IF_ERROR(status_);
    const std::optional<double> number = token && !token->quoted ? parse_number(token->text) : std::nullopt;
    if (!number) {
      return place().error("a number is expected, got {}", token ? token->text : "the end of the file");
    }
    value = *number;
  }
  if (const std::optional<PbrtToken> end = list ? next() : std::nullopt; list && (!end || end->text != "]")) {
    return place().error("the list must end with ] after {} numbers", out.size());
  }
  return status_;
}

}  // namespace lightmill

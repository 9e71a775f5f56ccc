#include "common/base/text.h"

#include <algorithm>
#include <array>

namespace lightmill {
namespace {

/// One UTF-8 character, or one invalid byte.
struct Character {
  char32_t code = 0;
  std::size_t bytes = 1;
  bool valid = false;
};

/// The first character of `text`, which is not empty. Overlong forms and surrogates are not valid (RFC 3629).
Character first_character(std::string_view text) {
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) {
    return {lead, 1, true};
  }
  const std::size_t bytes = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < bytes) {
    return {lead, 1, false};
  }
  char32_t code = lead & (0x7fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte(i) & 0xc0) != 0x80) {
      return {lead, 1, false};
    }
    code = code << 6 | (byte(i) & 0x3f);
  }
  constexpr std::array<char32_t, 5> kMin{0, 0, 0x80, 0x800, 0x10000};
  if (code < kMin[bytes] || code > 0x10ffff || (code >= 0xd800 && code <= 0xdfff)) {
    return {lead, 1, false};
  }
  return {code, bytes, true};
}

/// Control characters, marks of the writing direction, and characters that cannot be seen. Joiners are allowed, because
/// some scripts and emoji need them.
bool is_unprintable(char32_t code) {
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x00ad || code == 0x061c || code == 0x180e ||
         code == 0x200b || code == 0x200e || code == 0x200f || (code >= 0x2028 && code <= 0x202e) ||
         (code >= 0x2060 && code <= 0x206f) || code == 0xfeff || (code >= 0xe0000 && code <= 0xe007f);
}

std::string escaped(const Character& character) {
  const auto code = static_cast<std::uint32_t>(character.code);
  return code < 0x80 || !character.valid ? fmt::format("\\x{:02x}", code) : fmt::format("\\u{:04x}", code);
}

/// Writes invalid bytes, and characters that `keeps` rejects, as escapes.
template <class Keeps>
std::string escape_others(std::string_view text, Keeps keeps) {
  std::string out;
  while (!text.empty()) {
    const Character character = first_character(text);
    if (character.valid && keeps(character.code)) {
      out += text.substr(0, character.bytes);
    } else {
      out += escaped(character);
    }
    text.remove_prefix(character.bytes);
  }
  return out;
}

}  // namespace

Status check_name(std::string_view what, std::string_view name) {
  if (name.size() > kMaxNameBytes) {
    return invalid_argument("{}: must have at most {} bytes, got {}", what, kMaxNameBytes, name.size());
  }
  for (std::size_t i = 0; i < name.size();) {
    const Character character = first_character(name.substr(i));
    if (!character.valid) {
      return invalid_argument("{}: must be UTF-8, got '{}'", what, printable(name));
    }
    if (is_unprintable(character.code)) {
      return invalid_argument("{}: must not have control or invisible characters, got '{}'", what, printable(name));
    }
    i += character.bytes;
  }
  return ok_status();
}

std::string printable(std::string_view text, bool keep_lines) {
  return escape_others(text, [keep_lines](char32_t code) {
    return !is_unprintable(code) || (keep_lines && (code == '\n' || code == '\t'));
  });
}

std::string utf8_text(std::string_view text) {
  return escape_others(text, [](char32_t /*code*/) { return true; });
}

std::string json_text(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out.push_back('\\');
    }
    if (static_cast<unsigned char>(c) < 0x20) {
      out += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
    } else {
      out.push_back(c);
    }
  }
  return out + '"';
}

std::string library_text(std::string_view text) {
  constexpr std::size_t kMaxBytes = 400;
  constexpr std::string_view kBlanks = " \t\r\n";
  std::string line;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view part = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    part.remove_prefix(std::min(part.find_first_not_of(kBlanks), part.size()));
    part = part.substr(0, part.find_last_not_of(kBlanks) + 1);
    if (!part.empty()) {
      line.append(line.empty() ? "" : "; ").append(part);
    }
  }
  while (line.ends_with('.')) {
    line.pop_back();
  }
  return cut_text(printable(line), kMaxBytes);
}

JsonFault json_fault(std::string_view text) {
  constexpr std::string_view kPlaced = "parse error at ";
  text.remove_prefix(text.find("] ") == text.npos ? 0 : text.find("] ") + 2);
  std::string place;
  if (const std::size_t end = text.find(": "); text.starts_with(kPlaced) && end != text.npos) {
    place = text.substr(kPlaced.size(), end - kPlaced.size());
    text.remove_prefix(end + 2);
  }
  return {place, library_text(text)};
}

std::string cut_text(std::string text, std::size_t most_bytes) {
  if (text.size() <= most_bytes) {
    return text;
  }
  std::size_t end = most_bytes;
  while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) {
    --end;  // inside a character
  }
  text.resize(end);
  return text + "…";
}

std::string as_name(std::string_view text) {
  std::string name = printable(text);
  std::size_t end = 0;
  while (end < name.size()) {
    const std::size_t bytes = first_character(std::string_view(name).substr(end)).bytes;
    if (end + bytes > kMaxNameBytes) {
      break;
    }
    end += bytes;
  }
  name.resize(end);
  return name;
}

}  // namespace lightmill

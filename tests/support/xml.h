// A minimal XML parser for tests.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lightmill::test {

/// A start tag: its name and its whole text.
struct XmlTag {
  std::string name, text;
  /// The value of an attribute; empty if it has none of that name.
  std::string attribute(const std::string& wanted) const {
    const std::size_t at = text.find(" " + wanted + "='");
    return at == std::string::npos
               ? ""
               : text.substr(at + wanted.size() + 3, text.find('\'', at + wanted.size() + 3) - at - wanted.size() - 3);
  }
};

/// All start tags in order, or nothing if the text is not well formed. It checks that elements nest, and that
/// attributes have single quotes. & may only begin the five entities or numbers. Comments, CDATA and doctypes are not
/// supported.
inline std::vector<XmlTag> xml_tags(std::string_view text) {
  std::vector<XmlTag> tags;
  std::vector<std::string> open;
  std::size_t at = text.starts_with("<?xml") ? text.find("?>") + 2 : 0;
  bool seen = false;
  while (at < text.size()) {
    const char c = text[at];
    if (c == '&') {
      const std::string_view entity = text.substr(at, text.find(';', at) - at);
      if (entity != "&amp" && entity != "&lt" && entity != "&gt" && entity != "&quot" && !entity.starts_with("&#")) {
        return {};
      }
      ++at;
      continue;
    }
    if (c != '<') {
      if (open.empty() && c != '\n') {
        return {};  // text outside the root element
      }
      ++at;
      continue;
    }
    const std::size_t end = text.find('>', at);
    if (end == std::string_view::npos) {
      return {};
    }
    const std::string inner(text.substr(at + 1, end - at - 1));
    at = end + 1;
    if (inner.starts_with("/")) {
      if (open.empty() || open.back() != inner.substr(1)) {
        return {};
      }
      open.pop_back();
      continue;
    }
    const bool closed = inner.ends_with("/");
    const std::string body = closed ? inner.substr(0, inner.size() - 1) : inner;
    const std::string name = body.substr(0, body.find(' '));
    std::size_t quotes = 0;
    for (const char letter : body) {
      quotes += letter == '\'';
    }
    if (quotes % 2 != 0 || body.find('<') != std::string::npos || (open.empty() && seen)) {
      return {};
    }
    seen = true;
    tags.push_back({name, body});
    if (!closed) {
      open.push_back(name);
    }
  }
  return open.empty() ? tags : std::vector<XmlTag>{};
}

}  // namespace lightmill::test

#include "common/base/library_text.h"

#include "common/base/text.h"

namespace lightmill {
namespace {

constexpr std::size_t kMostBytes = 400;
constexpr std::string_view kBlanks = " \t\r\n";

}  // namespace

std::string library_text(std::string_view text) {
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
  return cut_text(printable(line), kMostBytes);
}

}  // namespace lightmill

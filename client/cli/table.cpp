#include "client/cli/table.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>

#include "client/cli/text_width.h"
#include "common/base/text.h"

namespace lightmill::cli {

std::vector<std::string> format_table(std::vector<std::vector<std::string>> rows, int width) {
  for (auto& row : rows) {
    std::ranges::transform(row, row.begin(), [](const std::string& cell) { return printable(cell); });
  }
  std::vector<int> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], columns_of(row[i]));
    }
  }
  std::vector<std::string> lines;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t i = 0; i < row.size(); ++i) {
      line += row[i];
      if (i + 1 < row.size()) {
        line.append(static_cast<std::size_t>(widths[i] - columns_of(row[i])) + 2, ' ');
      }
    }
    lines.push_back(width > 0 ? cut_to_columns(line, width) : line);
  }
  return lines;
}

void print_table(const Console& console, const std::vector<std::vector<std::string>>& rows) {
  winsize size{};
  const bool terminal = ::isatty(STDOUT_FILENO) == 1 && ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0;
  for (const std::string& line : format_table(rows, terminal ? size.ws_col : 0)) {
    console.result(line);
  }
}

}  // namespace lightmill::cli

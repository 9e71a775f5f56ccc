#include "client/cli/table.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>

#include "common/base/text.h"
#include "common/base/text_width.h"

namespace lightmill::cli {

namespace {

constexpr int kGap = 2;
/// Indentation of a row's further lines.
constexpr int kIndent = 4;
/// A column becomes narrower than this only if each row already takes several lines.
constexpr int kLeastWrapped = 24;

/// Columns side by side, with their widths.
struct Block {
  int indent = 0;
  std::vector<std::pair<std::size_t, int>> columns;
};

void escape(Rows& rows) {
  for (auto& row : rows) {
    std::ranges::transform(row, row.begin(), [](const std::string& cell) { return printable(cell); });
  }
}

/// The width of each column's widest cell.
std::vector<int> widths_of(const Rows& rows) {
  std::vector<int> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], columns_of(row[i]));
    }
  }
  return widths;
}

/// The layout of a row: one block, or several below each other.
std::vector<Block> layout(std::vector<int> widths, int width) {
  int all = -kGap;
  for (const int each : widths) {
    all += each + kGap;
  }
  const auto widest = std::ranges::max_element(widths);
  if (width > 0 && all > width && *widest - (all - width) >= kLeastWrapped) {
    *widest -= all - width;
    all = width;
  }
  std::vector<Block> blocks(1);
  int used = -kGap;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    if (width > 0 && all > width && !blocks.back().columns.empty() && used + kGap + widths[i] > width) {
      blocks.push_back({std::min(kIndent, width / 4), {}});
      used = blocks.back().indent - kGap;
    }
    const int room = std::max(width - used - kGap, 2);
    blocks.back().columns.emplace_back(i, width > 0 ? std::min(widths[i], room) : widths[i]);
    used += kGap + blocks.back().columns.back().second;
  }
  return blocks;
}

struct Line {
  std::string text;
  int columns = 0;

  void append(const std::string& more, int at, int color) {
    text.append(static_cast<std::size_t>(at - columns), ' ');
    text += color == 0 ? more : fmt::format("\x1b[{}m{}\x1b[0m", color, more);
    columns = at + columns_of(more);
  }
};

void add_block(const std::vector<std::string>& row, const Block& block, const Coloring& coloring,
               std::vector<std::string>& lines) {
  std::vector<Line> block_lines;
  int begin = block.indent;
  for (const auto& [column, width] : block.columns) {
    if (column < row.size()) {
      const int color = column == coloring.column ? coloring.code(row[column]) : 0;
      const std::vector<std::string> cell = wrap_to_columns(row[column], std::max(width, 2));
      block_lines.resize(std::max(block_lines.size(), cell.size()));
      for (std::size_t i = 0; i < cell.size(); ++i) {
        if (!cell[i].empty()) {
          block_lines[i].append(cell[i], begin, color);
        }
      }
    }
    begin += width + kGap;
  }
  std::ranges::transform(block_lines, std::back_inserter(lines), [](Line& line) { return std::move(line.text); });
}

}  // namespace

std::vector<std::string> format_table(Rows rows, int width, const Coloring& coloring) {
  escape(rows);
  const std::vector<Block> blocks = layout(widths_of(rows), width);
  std::vector<std::string> lines;
  for (const auto& row : rows) {
    for (const Block& block : blocks) {
      add_block(row, block, coloring, lines);
    }
  }
  return lines;
}

std::vector<std::string> format_table_in_lines(Rows rows, int width) {
  std::vector<std::string> lines = format_table(std::move(rows), 0);
  if (width > 0) {
    std::ranges::transform(lines, lines.begin(), [&](const std::string& line) { return cut_to_columns(line, width); });
  }
  return lines;
}

void print_table(const Console& console, const Rows& rows, const Coloring& coloring) {
  const int columns = terminal_columns(STDOUT_FILENO);
  const char* const no_color = std::getenv("NO_COLOR");
  const bool colored = columns > 0 && (no_color == nullptr || *no_color == '\0');
  for (const std::string& line : format_table(rows, columns, colored ? coloring : Coloring())) {
    console.styled_result(line);  // cells are escaped
  }
}

}  // namespace lightmill::cli

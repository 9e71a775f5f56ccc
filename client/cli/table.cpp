#include "client/cli/table.h"

#include <unistd.h>

#include <algorithm>

#include "common/base/text.h"
#include "common/base/text_width.h"

namespace lightmill::cli {

namespace {

constexpr int kGap = 2;
/// Further lines of a row begin here.
constexpr int kIndent = 4;
/// A column is wrapped to fewer columns of the terminal only where each row takes several lines.
constexpr int kLeastWrapped = 24;

/// Columns of a table side by side, each so wide.
struct Block {
  int indent = 0;
  std::vector<std::pair<std::size_t, int>> columns;
};

void escape(Rows& rows) {
  for (auto& row : rows) {
    std::ranges::transform(row, row.begin(), [](const std::string& cell) { return printable(cell); });
  }
}

/// Of each column's widest cell.
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

/// How a row is laid out: one block, or several below each other.
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

void add_block(const std::vector<std::string>& row, const Block& block, std::vector<std::string>& lines) {
  std::vector<std::string> block_lines;
  std::size_t column_begin = static_cast<std::size_t>(block.indent);
  for (const auto& [column, width] : block.columns) {
    const std::vector<std::string> cell =
        column < row.size() ? wrap_to_columns(row[column], std::max(width, 2)) : std::vector<std::string>{};
    for (std::size_t i = 0; i < cell.size(); ++i) {
      block_lines.resize(std::max(block_lines.size(), i + 1));
      if (!cell[i].empty()) {
        std::string& line = block_lines[i];
        line.append(column_begin - static_cast<std::size_t>(columns_of(line)), ' ');
        line += cell[i];
      }
    }
    column_begin += static_cast<std::size_t>(width + kGap);
  }
  std::ranges::move(block_lines, std::back_inserter(lines));
}

}  // namespace

std::vector<std::string> format_table(Rows rows, int width) {
  escape(rows);
  const std::vector<Block> blocks = layout(widths_of(rows), width);
  std::vector<std::string> lines;
  for (const auto& row : rows) {
    for (const Block& block : blocks) {
      add_block(row, block, lines);
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

void print_table(const Console& console, const Rows& rows) {
  for (const std::string& line : format_table(rows, terminal_columns(STDOUT_FILENO))) {
    console.result(line);
  }
}

}  // namespace lightmill::cli

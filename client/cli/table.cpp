#include "client/cli/table.h"

#include <unistd.h>

#include <algorithm>
#include <span>

#include "common/base/text.h"
#include "common/base/text_width.h"

namespace lightmill::cli {

namespace {

constexpr int kGap = 2;
/// Indentation of a row's further lines.
constexpr int kIndent = 4;
/// A column is not wrapped to less, unless it is alone in its block.
constexpr int kMinWrapped = 24;

/// A cell is not shortened to less.
constexpr int kMinShortened = 16;

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

/// Widths of a column.
struct Widths {
  int all = 0;    ///< of its widest cell
  int least = 0;  ///< it is not wrapped to less, unless it is alone in its block
};

std::vector<Widths> widths_of(const Rows& rows) {
  std::vector<Widths> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i].all = std::max(widths[i].all, columns_of(row[i]));
      widths[i].least = std::max(widths[i].least, widest_word(row[i]));
    }
  }
  for (Widths& each : widths) {
    each.least = std::max(each.least, std::min(each.all, kMinWrapped));
  }
  return widths;
}

int width_of(const Block& block) {
  int width = block.indent - kGap;
  for (const auto& [column, each] : block.columns) {
    width += kGap + each;
  }
  return width;
}

/// Makes the widest columns narrower until the block fits.
void shrink(Block& block, const std::vector<Widths>& widths, int width) {
  for (int over = width_of(block) - width; over > 0; --over) {
    const auto widest = std::ranges::max_element(block.columns, {}, [&](const auto& column) {
      return std::pair(column.second > widths[column.first].least, column.second);
    });
    widest->second = std::max(widest->second - 1, 2);
  }
}

/// The layout of a row: one block, or several below each other. `width` 0: no limit.
std::vector<Block> layout(const std::vector<Widths>& widths, int width) {
  Block all;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    all.columns.emplace_back(i, widths[i].all);
  }
  const int over = width > 0 ? width_of(all) - width : 0;
  if (const auto widest = std::ranges::max_element(all.columns, {}, &std::pair<std::size_t, int>::second);
      over <= 0 || widest->second - over >= kMinWrapped) {
    if (over > 0) {
      widest->second -= over;
    }
    return {all};
  }
  std::vector<Block> blocks(1);
  int used = -kGap;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    if (!blocks.back().columns.empty() && used + kGap + widths[i].least > width) {
      shrink(blocks.back(), widths, width);
      blocks.push_back({std::min(kIndent, width / 4), {}});
      used = blocks.back().indent - kGap;
    }
    blocks.back().columns.emplace_back(i, widths[i].all);
    used += kGap + widths[i].least;
  }
  shrink(blocks.back(), widths, width);
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

/// "cornell-be…blocks": the first and the last characters.
std::string shortened(std::string_view text, int columns) {
  if (columns_of(text) <= columns) {
    return std::string(text);
  }
  const std::string head = cut_to_columns(text, columns / 2);
  while (!text.empty() && columns_of(text) > columns - 1 - columns_of(head)) {
    const std::string first = cut_to_columns(text, 1);
    text.remove_prefix(first.empty() ? std::max<std::size_t>(cut_to_columns(text, 2).size(), 1) : first.size());
  }
  return cut_to_columns(fmt::format("{}…{}", head, text), columns);
}

/// Whether the first column stays whole.
bool keeps_first(const std::vector<Widths>& widths, int width) {
  return widths.size() > 1 && widths[0].all <= width;
}

/// The width of the first columns, the long ones shortened.
int least_width(const std::vector<Widths>& widths, std::size_t columns, bool keeps_first) {
  int width = -kGap;
  for (std::size_t i = 0; i < columns; ++i) {
    width += kGap + (i == 0 && keeps_first ? widths[i].all : std::min(widths[i].all, kMinShortened));
  }
  return width;
}

/// The number of first columns that fit into a line, the long ones shortened. At least one.
std::size_t columns_shown(const std::vector<Widths>& widths, int width) {
  std::size_t columns = widths.size();
  while (columns > 1 && least_width(widths, columns, keeps_first(widths, width)) > width) {
    --columns;
  }
  return columns;
}

/// A line of the first columns. The widest ones are narrowed until it fits.
Block line_layout(const std::vector<Widths>& widths, int width) {
  Block block;
  for (std::size_t i = 0; i < columns_shown(widths, width); ++i) {
    block.columns.emplace_back(i, widths[i].all);
  }
  const auto narrowed = std::span(block.columns).subspan(keeps_first(widths, width) ? 1 : 0);
  for (int over = width_of(block) - width; over > 0; --over) {
    --std::ranges::max_element(narrowed, {}, &std::pair<std::size_t, int>::second)->second;
  }
  return block;
}

/// The columns of standard output's terminal; 0: none.
int output_columns() {
  return terminal_columns(STDOUT_FILENO);
}

Coloring coloring_of_output(const Coloring& coloring) {
  return output_columns() > 0 && colors_wanted() ? coloring : Coloring();
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

std::vector<std::string> format_table_in_lines(Rows rows, int width, const Coloring& coloring) {
  if (width <= 0) {
    return format_table(std::move(rows), 0, coloring);
  }
  escape(rows);
  const Block block = line_layout(widths_of(rows), width);
  std::vector<std::string> lines;
  for (auto& row : rows) {
    for (const auto& [column, most] : block.columns) {
      if (column < row.size()) {
        row[column] = shortened(row[column], most);
      }
    }
    add_block(row, block, coloring, lines);
  }
  return lines;
}

std::string hidden_columns(Rows rows, int width) {
  escape(rows);
  const std::vector<Widths> widths = widths_of(rows);
  const std::size_t shown = columns_shown(widths, width);
  if (width <= 0 || shown >= widths.size()) {
    return "";
  }
  return fmt::format("hidden: {} (needs {} columns)",
                     fmt::join(rows.front().begin() + static_cast<std::ptrdiff_t>(shown), rows.front().end(), ", "),
                     least_width(widths, widths.size(), keeps_first(widths, width)));
}

std::string shortened_columns(Rows rows, int width) {
  escape(rows);
  const std::vector<Widths> widths = widths_of(rows);
  std::vector<std::string> names;
  if (width > 0) {
    for (const auto& [column, columns] : line_layout(widths, width).columns) {
      if (columns < widths[column].all) {
        names.push_back(rows.front()[column]);
      }
    }
  }
  if (names.empty()) {
    return "";
  }
  Block whole;
  for (std::size_t i = 0; i < widths.size(); ++i) {
    whole.columns.emplace_back(i, widths[i].all);
  }
  return fmt::format("shortened: {} (needs {} columns)", fmt::join(names, ", "), width_of(whole));
}

void print_table(const Console& console, const Rows& rows, const Coloring& coloring) {
  for (const std::string& line : format_table(rows, output_columns(), coloring_of_output(coloring))) {
    console.styled_result(line);  // cells are escaped
  }
}

void print_table_in_lines(const Console& console, const Rows& rows, const Coloring& coloring) {
  const int columns = output_columns();
  for (const std::string& line : format_table_in_lines(rows, columns, coloring_of_output(coloring))) {
    console.styled_result(line);  // cells are escaped
  }
  const std::string hidden = hidden_columns(rows, columns), shortened = shortened_columns(rows, columns);
  if (!hidden.empty() || !shortened.empty()) {
    console.notice(fmt::format("{}{}{}", hidden, hidden.empty() || shortened.empty() ? "" : "; ", shortened));
  }
}

}  // namespace lightmill::cli

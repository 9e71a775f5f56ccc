#include "client/cli/table.h"

#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>
#include <numeric>
#include <set>
#include <utility>

#include "common/base/text.h"
#include "common/base/text_width.h"

namespace lightmill::cli {

namespace {

constexpr int kGap = 2;
/// Indentation of the lines below a row.
constexpr int kIndent = 4;
/// A column is not wrapped to less if others can stand below the row instead.
constexpr int kMinWrapped = 24;
/// The first columns that name a row, such as the number and name of a job. A long name leaves half of the width to
/// the columns after it.
constexpr std::size_t kNames = 2;

void escape(Rows& rows) {
  for (auto& row : rows) {
    std::ranges::transform(row, row.begin(), [](const std::string& cell) { return printable(cell); });
  }
}

/// Whether the rows are names and texts. They may have no header, so both columns stand side by side at any width.
bool are_pairs(const Rows& rows) {
  return std::ranges::all_of(rows, [](const auto& row) { return row.size() <= 2; });
}

/// The widths of the columns that stand side by side. `width` 0: no limit, so these are all columns.
std::vector<int> widths_beside(const Rows& rows, int width) {
  std::vector<int> widths, least;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    least.resize(widths.size());
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], columns_of(row[i]));
      least[i] = std::max(least[i], widest_word(row[i]));
    }
  }
  if (width <= 0) {
    return widths;
  }
  const bool pairs = are_pairs(rows);
  std::size_t beside = 0;
  int used = -kGap;
  for (; beside < widths.size(); ++beside) {
    int& most = least[beside];
    most = std::max(most, std::min(widths[beside], kMinWrapped));
    most = beside < kNames ? std::min(most, std::max(width / 2, 1)) : most;
    used += kGap + most;
    if (used > width && beside > 0 && !pairs) {
      break;
    }
  }
  widths.resize(beside);
  const int all =
      std::accumulate(widths.begin(), widths.end(), -kGap, [](int sum, int each) { return sum + kGap + each; });
  for (int over = all - width; over > 0; --over) {  // makes the widest columns narrower
    std::size_t widest = 0;
    for (std::size_t i = 1; i < beside; ++i) {
      if (std::pair(widths[i] > least[i], widths[i]) > std::pair(widths[widest] > least[widest], widths[widest])) {
        widest = i;
      }
    }
    widths[widest] = std::max(widths[widest] - 1, 1);
  }
  return widths;
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

/// "owner ada": a cell below its row. Empty for a cell without a value.
std::string with_heading(std::string heading, const std::string& cell) {
  std::ranges::transform(heading, heading.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return cell.empty() || cell == "-" ? "" : heading.empty() ? cell : fmt::format("{} {}", heading, cell);
}

/// Formats a table of these columns row by row.
class RowFormat {
 public:
  RowFormat(const Rows& rows, int width, const Coloring& coloring)
      : heads_(rows.front()),
        width_(width),
        coloring_(coloring),
        pairs_(are_pairs(rows)),
        widths_(widths_beside(rows, width)) {}

  std::vector<std::string> lines_of(const std::vector<std::string>& row) const {
    std::vector<Line> beside;
    std::vector<std::string> below;
    int begin = 0;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const bool whole = i < widths_.size() && (pairs_ || widest_word(row[i]) <= widths_[i]);
      if (i < widths_.size()) {
        add_cell(whole ? wrap_to_columns(row[i], std::max(widths_[i], 2)) : std::vector{shortened(row[i], widths_[i])},
                 begin, i == coloring_.column ? coloring_.code(row[i]) : 0, beside);
        begin += widths_[i] + kGap;
      }
      const std::string text = whole || &row == &heads_ ? "" : with_heading(heads_.at(i), row[i]);
      if (!text.empty()) {
        below.push_back(text);
      }
    }
    std::vector<std::string> lines;
    std::ranges::transform(beside, std::back_inserter(lines), [](Line& line) { return std::move(line.text); });
    if (!below.empty()) {
      const int indent = std::min(kIndent, width_ / 4);
      for (const std::string& line :
           wrap_to_columns(fmt::format("{}", fmt::join(below, "; ")), std::max(width_ - indent, 2))) {
        lines.push_back(std::string(static_cast<std::size_t>(indent), ' ') + line);
      }
    }
    return lines;
  }

 private:
  static void add_cell(const std::vector<std::string>& cell, int begin, int color, std::vector<Line>& lines) {
    lines.resize(std::max(lines.size(), cell.size()));
    for (std::size_t i = 0; i < cell.size(); ++i) {
      if (!cell[i].empty()) {
        lines[i].append(cell[i], begin, color);
      }
    }
  }

  const std::vector<std::string>& heads_;
  const int width_;
  const Coloring& coloring_;
  const bool pairs_;
  const std::vector<int> widths_;
};

/// A name of this width can be recognised. A name column is not narrower while others can give way.
constexpr int kMinName = 16;

/// The width of the widest cell of each column.
std::vector<int> widest_cells(const Rows& rows) {
  std::vector<int> widths;
  for (const auto& row : rows) {
    widths.resize(std::max(widths.size(), row.size()));
    for (std::size_t i = 0; i < row.size(); ++i) {
      widths[i] = std::max(widths[i], columns_of(row[i]));
    }
  }
  return widths;
}

/// The begin of the first word or number in which the texts differ. A word ends at one of " -_./".
std::size_t first_difference(std::string_view a, std::string_view b) {
  const auto same = static_cast<std::size_t>(std::ranges::mismatch(a, b).in1 - a.begin());
  const std::size_t end = a.substr(0, same).find_last_of(" -_./");
  return end == std::string_view::npos ? 0 : end + 1;
}

/// Shortens the texts of a column. Those that would look alike lose what they have in common instead.
void shorten_column(Rows& rows, std::size_t column, int columns) {
  std::map<std::string, std::set<std::string>> alike;
  for (const auto& row : rows) {
    alike[shortened(row[column], columns)].insert(row[column]);
  }
  for (auto& row : rows) {
    std::string& cell = row[column];
    const std::string text = shortened(cell, columns);
    const std::set<std::string>& group = alike.at(text);
    const std::size_t same = first_difference(*group.begin(), *group.rbegin());
    const std::string head = fmt::format("{}…", cut_to_columns(cell, columns / 4));
    const bool apart = group.size() > 1 && same > head.size();
    cell = apart ? head + shortened(std::string_view(cell).substr(same), columns - columns_of(head)) : text;
  }
}

Rows first_columns(Rows rows, std::size_t count) {
  for (auto& row : rows) {
    row.resize(std::min(row.size(), count));
  }
  return rows;
}

Coloring coloring_of_output(const Coloring& coloring) {
  return terminal_columns(STDOUT_FILENO) > 0 && colors_wanted() ? coloring : Coloring();
}

}  // namespace

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

std::vector<std::vector<std::string>> format_rows(Rows rows, int width, const Coloring& coloring) {
  std::vector<std::vector<std::string>> lines;
  if (!rows.empty()) {
    escape(rows);
    const RowFormat format(rows, width, coloring);
    for (const auto& row : rows) {
      lines.push_back(format.lines_of(row));
    }
  }
  return lines;
}

std::vector<std::string> format_table(Rows rows, int width, const Coloring& coloring) {
  std::vector<std::string> lines;
  for (auto& row : format_rows(std::move(rows), width, coloring)) {
    std::ranges::move(row, std::back_inserter(lines));
  }
  return lines;
}

Rows squeezed(Rows rows, int width, const Squeeze& squeeze) {
  escape(rows);
  const std::vector<int> widths = widest_cells(rows);
  // The columns of the first `count` columns, without those of the name.
  const auto width_of = [&](std::size_t count) {
    return std::accumulate(widths.begin(), widths.begin() + static_cast<std::ptrdiff_t>(count),
                           kGap * (static_cast<int>(count) - 1) - widths[squeeze.name]);
  };
  const int least_name = std::min(widths[squeeze.name], kMinName);
  std::size_t count = widths.size();
  while (count > squeeze.kept && width_of(count) + least_name > width) {
    --count;
  }
  const bool one_line = width_of(count) + least_name <= width;
  const int name = one_line ? width - width_of(count) : std::max(std::min(kMinWrapped, width / 2), 2);
  shorten_column(rows, squeeze.name, name);
  if (one_line) {
    return first_columns(std::move(rows), count);
  }
  const auto takes_two_lines = [&](std::size_t columns) {
    return std::ranges::all_of(format_rows(first_columns(rows, columns), width),
                               [](const auto& lines) { return lines.size() <= 2; });
  };
  count = widths.size();
  while (count > squeeze.kept && !takes_two_lines(count)) {
    --count;
  }
  return first_columns(std::move(rows), count);
}

void print_table(const Console& console, Rows rows, const Coloring& coloring, const Squeeze& squeeze) {
  const int width = output_columns(STDOUT_FILENO);
  print_table(console, width > 0 ? squeezed(std::move(rows), width, squeeze) : rows, coloring);
}

void print_table(const Console& console, const Rows& rows, const Coloring& coloring) {
  for (const std::string& line : format_table(rows, output_columns(STDOUT_FILENO), coloring_of_output(coloring))) {
    console.styled_result(line);  // cells are escaped
  }
}

}  // namespace lightmill::cli

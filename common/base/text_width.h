// The width of text in a terminal.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// Columns of the terminal behind this descriptor. 0 if it is not a terminal.
int terminal_columns(int descriptor);

/// Columns for text that goes to this descriptor: those of the variable COLUMNS (20 to 10,000), else those of its
/// terminal, else 0. 0 means no limit: text in pipes and files is not wrapped. A value of COLUMNS that is not such a
/// number is ignored.
int output_columns(int descriptor);

/// Whether text can be moved and replaced there: a terminal, and TERM names one that is not "dumb".
bool can_redraw(int descriptor);

/// Whether terminals get coloured text: NO_COLOR is not set, and TERM names a terminal that is not "dumb".
bool colors_wanted();

/// Columns of UTF-8 text: two for a wide character (CJK, emoji), none for a combining one.
int columns_of(std::string_view text);

/// Columns of the widest word; words end at spaces.
int widest_word(std::string_view text);

/// As many of the first characters as fit into `columns`.
std::string cut_to_columns(std::string_view text, int columns);

/// Lines of at most `columns` columns, which must be 2 or more. A line ends between words, or inside a word that is
/// longer than a line. A number stays with its unit. At least one line.
std::vector<std::string> wrap_to_columns(std::string_view text, int columns);

/// The same for sentences. Longer words stay whole, because people copy addresses and tokens. No line ends inside a
/// `command` or the beginning of a (default: value), if that fits a line.
std::vector<std::string> wrap_sentences(std::string_view text, int columns);

/// Each line of the text wrapped in the same way. Unchanged for less than 20 columns, where terminals break lines.
std::string wrap_lines(std::string_view text, int columns);

}  // namespace lightmill

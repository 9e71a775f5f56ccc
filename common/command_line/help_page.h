// The page that --help prints.
#pragma once

#include <string>
#include <string_view>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// Help pages name the options of this group, and leave their texts to `lightmill help access`.
constexpr const char* kBriefAccess = "Access (`lightmill help access`)";

/// Paragraphs and indented lines, such as examples, wrapped to `columns` columns. A long example continues after a
/// backslash, as a shell reads it. Comments, which two or more spaces separate, move below the examples of a block if
/// one of them does not fit. Beside short examples they are wrapped.
std::string wrapped_text(std::string_view text, int columns);

/// Wrapped to the width of standard output's terminal, else to 100 columns.
std::string text_for_terminal(std::string_view text);

/// "Usage: lightmill fetch JOB --output FILE... [OPTIONS]".
std::string usage_of(const CommandDoc& command);

/// Wrapped to `columns` columns.
std::string help_page(const CommandDoc& command, int columns);

/// Wrapped as text_for_terminal.
std::string help_page_for_terminal(const CLI::App& app);

/// Makes `app` and all its commands print this page for --help.
void use_help_pages(CLI::App& app);

}  // namespace lightmill

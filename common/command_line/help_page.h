// The page that --help prints.
#pragma once

#include <string>
#include <string_view>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// Help pages name the options of this group, and leave their texts to `lightmill help access`.
constexpr const char* kBriefAccess = "Access (`lightmill help access`)";

/// Paragraphs and indented lines, such as examples, wrapped to `columns` columns. Two or more spaces separate an
/// example from its comment. If one line of a block does not fit, the whole block changes: comments are wrapped beside
/// short examples, and move below long ones. A long example continues after a backslash, as a shell reads it.
std::string wrapped_text(std::string_view text, int columns);

/// The same, wrapped to the width of standard output's terminal, else to 100 columns.
std::string text_for_terminal(std::string_view text);

/// "Usage: lightmill fetch JOB --output FILE... [OPTIONS]".
std::string usage_of(const CommandDoc& command);

/// The page of a command, wrapped to `columns` columns.
std::string help_page(const CommandDoc& command, int columns);

/// The same, wrapped as by text_for_terminal.
std::string help_page_for_terminal(const CLI::App& app);

/// Makes `app` and all its commands print this page for --help.
void use_help_pages(CLI::App& app);

}  // namespace lightmill

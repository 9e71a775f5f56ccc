// A program's manual page.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// For section 1, in the man macros. `date` ("2026-11-23") and `version` stand in the page's footer.
std::string man_page(const CommandDoc& program, const std::string& version, const std::string& date);

}  // namespace lightmill

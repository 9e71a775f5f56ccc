// A program's manual page.
#pragma once

#include <string>

#include "common/command_line/command_tree.h"

namespace lightmill {

/// For section 1, in man macros. The footer shows `date` ("2026-11-23") and `version`.
std::string man_page(const CommandDoc& program, const std::string& version, const std::string& date);

}  // namespace lightmill

// What a library says of its failure, as the end of a message of ours.
#pragma once

#include <string>
#include <string_view>

namespace lightmill {

/// `text` on one line, its lines joined by "; ", without blanks at its ends; printable, and cut.
std::string library_text(std::string_view text);

}  // namespace lightmill

// Errors for words that are not in a list, with the nearest word of it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace lightmill {

/// ". Did you mean 'watch'?", with the nearest word. Empty if none is near.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& words);

/// "unknown state 'runnin'. Did you mean 'running'? Known states: queued, running".
std::string unknown_text(std::string_view kind, std::string_view word, const std::vector<std::string>& known);

}  // namespace lightmill

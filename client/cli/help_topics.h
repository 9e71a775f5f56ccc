// Topics of `lightmill help`: texts that several commands share, or that are too long for --help.
#pragma once

#include <span>
#include <string_view>
#include <vector>

#include "client/cli/console.h"

namespace lightmill::cli {

struct HelpTopic {
  std::string_view name, about;
  void (*explain)(const Console& console);
};

/// By name. No topic has the name of a command.
std::span<const HelpTopic> help_topics();
std::vector<std::string_view> help_topic_names();

}  // namespace lightmill::cli

#include "common/command_line/descriptions.h"

#include <fmt/ranges.h>

#include <algorithm>

#include "common/command_line/help_page.h"

namespace lightmill {
namespace {

std::string block(const std::string& lines) {
  return fmt::format("```text\n{}```\n\n", lines);
}

/// Indented lines, such as examples, become blocks.
std::string markdown_text(const std::string& text) {
  std::string out, paragraph, examples;
  const auto end = [&] {
    out += paragraph.empty() ? "" : paragraph + "\n\n";
    out += examples.empty() ? "" : block(examples);
    paragraph.clear();
    examples.clear();
  };
  for (const std::string& line : CLI::detail::split(text, '\n')) {
    const bool example = line.starts_with("  ");
    if (line.empty() || example != !examples.empty()) {
      end();
    }
    if (example) {
      examples += line.substr(2) + "\n";
    } else if (!line.empty()) {
      paragraph += (paragraph.empty() ? "" : " ") + line;
    }
  }
  end();
  return out;
}

/// Text of a table's cell.
std::string cell(const std::string& text) {
  std::string out;
  for (const char letter : text) {
    out += letter == '|' || letter == '*' || letter == '<' ? std::string{'\\', letter} : std::string{letter};
  }
  return out;
}

/// Code in a table's cell, where only bars are escaped.
std::string code(const std::string& text) {
  std::string out;
  for (const char letter : text) {
    out += letter == '|' ? "\\|" : std::string{letter};
  }
  return fmt::format("`{}`", out);
}

std::string row_of(const OptionDoc& option) {
  std::string names = fmt::format("{}", fmt::join(option.names, ", "));
  names += option.value.empty() ? "" : " " + option.shown_value();
  std::string text = cell(option.text) + (option.required ? " (must be given)" : "");
  if (const std::string& value = option.default_value; !value.empty()) {
    text += fmt::format("; default: {}", value.find(' ') == std::string::npos ? code(value) : cell(value));
  }
  text += option.variable.empty() ? "" : fmt::format("; or {}", code("$" + option.variable));
  return fmt::format("| {} | {} |\n", code(names), text);
}

/// A table for each group.
std::string option_tables(const std::vector<OptionDoc>& options) {
  std::vector<std::pair<std::string, std::string>> groups;
  for (const OptionDoc& option : options) {
    auto group = std::ranges::find(groups, option.group, [](const auto& each) { return each.first; });
    if (group == groups.end()) {
      group = groups.insert(groups.end(), {option.group, ""});
    }
    group->second += row_of(option);
  }
  std::string out;
  for (const auto& [name, rows] : groups) {
    out += fmt::format("| {} | |\n| --- | --- |\n{}\n", name, rows);
  }
  return out;
}

std::string command_part(const std::string& mark, const CommandDoc& command, const std::vector<OptionDoc>& shared) {
  std::string out = fmt::format("{} {}\n\n{}", mark, command.words(), markdown_text(command.about));
  out += block(usage_of(command) + "\n");
  std::vector<OptionDoc> own;
  std::vector<std::string> also;
  for (const OptionDoc& option : command.options) {
    if (std::ranges::find(shared, option) == shared.end()) {
      own.push_back(option);
    } else {
      also.push_back(code(option.names.back()));
    }
  }
  std::string arguments;
  for (const OptionDoc& position : command.positions) {
    arguments += fmt::format("| {} | {} |\n", code(position.names.front()), cell(position.text));
  }
  out += arguments.empty() ? "" : fmt::format("| Argument | |\n| --- | --- |\n{}\n", arguments);
  out += option_tables(own);
  out += also.empty() ? "" : fmt::format("[Also](#options-of-several-commands): {}.\n\n", fmt::join(also, ", "));
  return out + markdown_text(command.footer);
}

}  // namespace

std::string markdown_page(const CommandDoc& program) {
  const std::vector<const CommandDoc*> commands = all_commands(program);
  const std::vector<OptionDoc> shared = shared_options({commands.begin() + 1, commands.end()});
  std::string page = command_part("##", program, {});
  for (const CommandDoc* command : commands) {
    page += command == &program ? "" : command_part("###", *command, shared);
  }
  return page + (shared.empty() ? "" : "### Options of several commands\n\n" + option_tables(shared));
}

}  // namespace lightmill

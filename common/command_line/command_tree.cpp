#include "common/command_line/command_tree.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <functional>

namespace lightmill {
namespace {

const std::function<bool(const CLI::App*)> kAll = nullptr;

OptionDoc option_doc(const CLI::Option& option) {
  OptionDoc doc;
  if (option.nonpositional()) {
    for (const std::string& name : option.get_snames()) {
      doc.names.push_back("-" + name);
    }
    for (const std::string& name : option.get_lnames()) {
      doc.names.push_back("--" + name);
    }
  } else {
    doc.names.push_back(option.get_name(true));
  }
  const int most = option.get_items_expected_max();
  doc.value = most > 0 ? option.get_type_name() : "";
  doc.text = option.get_description();
  doc.value_optional = most > 0 && option.get_expected_min() == 0;
  // For an optional value, the default string is the value used without one, not the default of the option.
  doc.default_value = doc.value_optional ? "" : option.get_default_str();
  doc.variable = option.get_envname();
  doc.group = option.get_group();
  doc.required = option.get_required();
  doc.repeats = most > 1;
  return doc;
}

/// Appends the option unless there is one with the same names.
void append_option(const OptionDoc& option, std::vector<OptionDoc>& options) {
  if (std::ranges::find(options, option.names, &OptionDoc::names) == options.end()) {
    options.push_back(option);
  }
}

/// Appends a command's options and those of its option groups. The parser stores groups as commands without a name.
void append_options(const CLI::App& app, CommandDoc& doc) {
  for (const CLI::Option* option : app.get_options()) {
    if (!option->get_group().empty()) {
      append_option(option_doc(*option), option->nonpositional() ? doc.options : doc.positions);
    }
  }
  for (const CLI::App* group : app.get_subcommands(kAll)) {
    if (group->get_name().empty()) {
      append_options(*group, doc);
    }
  }
}

CommandDoc command_doc(const CLI::App& app, const CommandDoc* parent, const std::string& parent_footer) {
  CommandDoc doc;
  doc.path = parent == nullptr ? std::vector<std::string>() : parent->path;
  doc.path.push_back(app.get_name());
  doc.about = app.get_description();
  doc.group = app.get_group();
  const std::string footer = app.get_footer();
  doc.footer = footer == parent_footer ? "" : footer;
  append_options(app, doc);
  if (parent != nullptr && app.get_fallthrough()) {
    for (const OptionDoc& option : parent->options) {
      append_option(option, doc.options);
    }
  }
  doc.needs_command = app.get_require_subcommand_min() > 0;
  for (const CLI::App* command : app.get_subcommands(kAll)) {
    if (!command->get_name().empty() && !command->get_group().empty()) {
      doc.commands.push_back(command_doc(*command, &doc, footer));
    }
  }
  return doc;
}

}  // namespace

std::string CommandDoc::words() const {
  return fmt::format("{}", fmt::join(path, " "));
}

CommandDoc command_tree(const CLI::App& app) {
  return command_doc(app, nullptr, "");
}

CommandDoc command_of(const CLI::App& app) {
  std::vector<const CLI::App*> line{&app};  // from the command to the program
  while (line.back()->get_parent() != nullptr) {
    line.push_back(line.back()->get_parent());
  }
  CommandDoc doc = command_tree(*line.back());
  for (std::size_t i = line.size() - 1; i-- > 0;) {
    const auto below = std::ranges::find(doc.commands, line[i]->get_name(), &CommandDoc::name);
    doc = CommandDoc(*below);
  }
  return doc;
}

}  // namespace lightmill

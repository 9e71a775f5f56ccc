#include "common/command_line/help_page.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>

#include "common/base/text_width.h"

namespace lightmill {
namespace {

/// Longer lines are hard to read.
constexpr int kMostColumns = 100;
constexpr int kLeastColumns = 40;

constexpr std::string_view kNoBreak = "\u00a0";

/// The command with no-break spaces between options and their values.
std::string glued(std::string_view command) {
  std::string text;
  bool after_option = false;
  for (const std::string& word : CLI::detail::split(std::string(command), ' ')) {
    text += text.empty() ? "" : after_option && !word.starts_with('-') ? kNoBreak : " ";
    text += word;
    after_option = word.starts_with('-');
  }
  return text;
}

std::string unglued(std::string text) {
  return CLI::detail::find_and_replace(std::move(text), std::string(kNoBreak), " ");
}

void add_example(std::string_view line, int columns, std::string& page) {
  if (columns_of(line) <= columns) {
    page += fmt::format("{}\n", line);
    return;
  }
  const std::size_t indent = line.find_first_not_of(' '), end = std::min(line.find("  ", indent), line.size());
  const std::string_view command = line.substr(indent, end - indent), comment = line.substr(end);
  const int room = columns - static_cast<int>(indent);
  const std::vector<std::string> lines =
      columns_of(command) <= room ? std::vector{std::string(command)} : wrap_to_columns(glued(command), room - 4);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    page +=
        fmt::format("{:{}}{}{}\n", "", indent + (i > 0 ? 2 : 0), unglued(lines[i]), i + 1 < lines.size() ? " \\" : "");
  }
  for (const std::string& part :
       wrap_to_columns(comment.substr(std::min(comment.find_first_not_of(' '), comment.size())), room - 4)) {
    page += part.empty() ? "" : fmt::format("{:{}}{}\n", "", indent + 4, part);
  }
}

void add_text(std::string_view text, int columns, std::string& page) {
  std::string paragraph;
  const auto end_paragraph = [&] {
    if (!paragraph.empty()) {
      for (const std::string& line : wrap_to_columns(paragraph, columns)) {
        page += line + "\n";
      }
      paragraph.clear();
    }
  };
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (line.empty() || line.starts_with(' ')) {
      end_paragraph();
      add_example(line, columns, page);
    } else {
      paragraph += fmt::format("{}{}", paragraph.empty() ? "" : " ", line);
    }
  }
  end_paragraph();
}

struct Entry {
  std::string name, text;
};

/// Names in a column, and their meaning beside it. The meaning of a long name is below it.
void add_entries(const std::vector<Entry>& entries, int columns, std::string& page) {
  int widest = 0;
  const int most = std::min(28, columns / 3);
  for (const Entry& entry : entries) {
    const int width = columns_of(entry.name);
    widest = width <= most ? std::max(widest, width) : widest;
  }
  const int begin = 2 + std::max(widest, 8) + 2;
  for (const Entry& entry : entries) {
    std::string line = "  " + entry.name;
    const bool fits = columns_of(line) + 2 <= begin;
    if (!fits || entry.text.empty()) {
      page += line + "\n";
      line.clear();
    }
    for (const std::string& part : wrap_to_columns(entry.text, columns - begin)) {
      if (!part.empty()) {
        line.append(static_cast<std::size_t>(begin - columns_of(line)), ' ');
        page += line + part + "\n";
        line.clear();
      }
    }
  }
}

Entry entry_of(const OptionDoc& option) {
  Entry entry{fmt::format("{}", fmt::join(option.names, ",")), option.text};
  if (!option.value.empty()) {
    entry.name += " " + option.shown_value();
  }
  if (option.required) {
    entry.text += " (must be given)";
  }
  const std::string& value = option.default_value;
  if (!option.variable.empty()) {
    entry.text += fmt::format(" (default: ${}{}{})", option.variable, value.empty() ? "" : ", else ", value);
  } else if (!value.empty()) {
    entry.text += fmt::format(" [{}]", value);
  }
  return entry;
}

Entry position_of(const OptionDoc& position) {
  return {position.names.front() + (position.repeats ? "..." : ""), position.text};
}

/// Groups in the order of their first entries.
template <class Doc, class EntryOf>
void add_groups(const std::vector<Doc>& docs, const EntryOf& entry_of_doc, int columns, std::string& page) {
  std::vector<std::pair<std::string, std::vector<Entry>>> groups;
  for (const Doc& doc : docs) {
    auto group = std::ranges::find(groups, doc.group, [](const auto& each) { return each.first; });
    if (group == groups.end()) {
      group = groups.insert(groups.end(), {doc.group, {}});
    }
    group->second.push_back(entry_of_doc(doc));
  }
  for (const auto& [name, entries] : groups) {
    page += fmt::format("\n{}:\n", name);
    add_entries(entries, columns, page);
  }
}

class HelpFormatter final : public CLI::FormatterBase {
 public:
  std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
    return help_page_for_terminal(*app);
  }
};

int columns_for_terminal() {
  const int columns = terminal_columns(STDOUT_FILENO);
  return columns == 0 ? kMostColumns : columns;
}

}  // namespace

std::string wrapped_text(std::string_view text, int columns) {
  std::string page;
  add_text(text, std::clamp(columns, kLeastColumns, kMostColumns), page);
  return page;
}

std::string text_for_terminal(std::string_view text) {
  return wrapped_text(text, columns_for_terminal());
}

std::string usage_of(const CommandDoc& command) {
  std::string usage = "Usage: " + command.words();
  for (const OptionDoc& position : command.positions) {
    const std::string name = position_of(position).name;
    usage += position.required ? " " + name : " [" + name + "]";
  }
  for (const OptionDoc& option : command.options) {
    if (option.required) {
      usage += fmt::format(" {} {}", option.names.back(), option.shown_value());
    }
  }
  usage += " [OPTIONS]";
  if (!command.commands.empty()) {
    usage += command.needs_command ? " COMMAND" : " [COMMAND]";
  }
  return usage;
}

std::string help_page(const CommandDoc& command, int columns) {
  columns = std::clamp(columns, kLeastColumns, kMostColumns);
  std::string page;
  add_text(command.about, columns, page);
  page += "\n";
  add_text(usage_of(command), columns, page);
  if (!command.positions.empty()) {
    std::vector<Entry> positions;
    std::ranges::transform(command.positions, std::back_inserter(positions), position_of);
    page += "\n";
    add_entries(positions, columns, page);
  }
  add_groups(
      command.commands,
      [](const CommandDoc& each) {
        return Entry{each.name(), each.about};
      },
      columns, page);
  add_groups(command.options, entry_of, columns, page);
  if (!command.footer.empty()) {
    page += "\n";
    add_text(command.footer, columns, page);
  }
  return page;
}

std::string help_page_for_terminal(const CLI::App& app) {
  return help_page(command_of(app), columns_for_terminal());
}

void use_help_pages(CLI::App& app) {
  app.formatter(std::make_shared<HelpFormatter>());
  for (CLI::App* const command : app.get_subcommands(std::function<bool(CLI::App*)>())) {
    use_help_pages(*command);
  }
}

}  // namespace lightmill

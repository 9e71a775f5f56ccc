#include "common/command_line/help_page.h"

#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <functional>

#include "common/base/text_width.h"

namespace lightmill {
namespace {

/// Longer lines are hard to read.
constexpr int kMaxColumns = 100;
constexpr int kMinColumns = 40;

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

struct Entry {
  std::string name, text;
};

int widest_name(int columns) {
  return std::min(28, columns / 3);
}

/// Names in a column, and their meaning beside it. The meaning of a long name is below it.
void add_entries(const std::vector<Entry>& entries, int columns, std::string& page) {
  int widest = 0;
  for (const Entry& entry : entries) {
    const int width = columns_of(entry.name);
    widest = width <= widest_name(columns) ? std::max(widest, width) : widest;
  }
  const int begin = 2 + std::max(widest, 8) + 2;
  for (const Entry& entry : entries) {
    std::string line = "  " + entry.name;
    const bool fits = columns_of(line) + 2 <= begin;
    if (!fits || entry.text.empty()) {
      page += line + "\n";
      line.clear();
    }
    for (const std::string& part : wrap_sentences(entry.text, columns - begin)) {
      if (!part.empty()) {
        line.append(static_cast<std::size_t>(begin - columns_of(line)), ' ');
        page += line + part + "\n";
        line.clear();
      }
    }
  }
}

/// An indented line: a command, and behind two spaces its meaning.
Entry example_of(std::string_view line) {
  const std::size_t begin = line.find_first_not_of(' '), end = std::min(line.find("  ", begin), line.size());
  const std::string_view text = line.substr(std::min(line.find_first_not_of(' ', end), line.size()));
  return {std::string(line.substr(begin, end - begin)), std::string(text)};
}

/// The meaning is below the command.
void add_example(const Entry& example, int columns, std::string& page) {
  const int room = columns - 2;
  const std::vector<std::string> lines =
      columns_of(example.name) <= room ? std::vector{example.name} : wrap_to_columns(glued(example.name), room - 4);
  for (std::size_t i = 0; i < lines.size(); ++i) {
    page += fmt::format("  {}{}{}\n", i > 0 ? "  " : "", unglued(lines[i]), i + 1 < lines.size() ? " \\" : "");
  }
  for (const std::string& part : wrap_sentences(example.text, room - 4)) {
    page += part.empty() ? "" : fmt::format("      {}\n", part);
  }
}

/// Consecutive indented lines. If one does not fit, all change. They become entries if all commands are short.
/// Otherwise each meaning moves below its command.
void add_examples(const std::vector<std::string_view>& lines, int columns, std::string& page) {
  if (std::ranges::all_of(lines, [&](std::string_view line) { return columns_of(line) <= columns; })) {
    page += fmt::format("{}\n", fmt::join(lines, "\n"));
    return;
  }
  std::vector<Entry> examples;
  std::ranges::transform(lines, std::back_inserter(examples), example_of);
  if (std::ranges::all_of(examples, [&](const Entry& each) {
        return !each.text.empty() && columns_of(each.name) <= widest_name(columns);
      })) {
    add_entries(examples, columns, page);
    return;
  }
  for (const Entry& example : examples) {
    add_example(example, columns, page);
  }
}

void add_text(std::string_view text, int columns, std::string& page) {
  std::string paragraph;
  std::vector<std::string_view> examples;
  const auto end_block = [&] {
    if (!paragraph.empty()) {
      page += wrap_lines(paragraph, columns) + "\n";
      paragraph.clear();
    }
    if (!examples.empty()) {
      add_examples(examples, columns, page);
      examples.clear();
    }
  };
  while (!text.empty()) {
    const std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(line.size() + 1, text.size()));
    if (line.empty() || line.starts_with(' ') != !examples.empty()) {
      end_block();
    }
    if (line.empty()) {
      page += "\n";
    } else if (line.starts_with(' ')) {
      examples.push_back(line);
    } else {
      paragraph += fmt::format("{}{}", paragraph.empty() ? "" : " ", line);
    }
  }
  end_block();
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
    entry.text += fmt::format(" (default: {})", value);
  }
  return entry;
}

Entry position_of(const OptionDoc& position) {
  return {position.names.front() + (position.repeats ? "..." : ""), position.text};
}

/// "  --tls-ca FILE, --tls-cert FILE".
void add_names(const std::vector<Entry>& entries, int columns, std::string& page) {
  std::vector<std::string> names;
  std::ranges::transform(entries, std::back_inserter(names), &Entry::name);
  for (const std::string& line : wrap_sentences(fmt::format("{}", fmt::join(names, ", ")), columns - 2)) {
    page += fmt::format("  {}\n", line);
  }
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
    if (name == kBriefAccess) {
      add_names(entries, columns, page);
    } else {
      add_entries(entries, columns, page);
    }
  }
}

class HelpFormatter final : public CLI::FormatterBase {
 public:
  std::string make_help(const CLI::App* app, std::string, CLI::AppFormatMode) const override {
    return help_page_for_terminal(*app);
  }
};

int columns_for_terminal() {
  const int columns = output_columns(STDOUT_FILENO);
  return columns == 0 ? kMaxColumns : columns;
}

}  // namespace

std::string wrapped_text(std::string_view text, int columns) {
  std::string page;
  add_text(text, std::clamp(columns, kMinColumns, kMaxColumns), page);
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
  columns = std::clamp(columns, kMinColumns, kMaxColumns);
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

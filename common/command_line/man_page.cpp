#include "common/command_line/descriptions.h"

#include <fmt/ranges.h>

#include <algorithm>

namespace lightmill {
namespace {

constexpr const char* kHelpFlag = "--help";

/// Text that troff prints letter by letter. Text between backticks is bold.
std::string escaped(std::string_view text) {
  std::string out;
  bool bold = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    switch (text[at]) {
      case '`':
        if (!bold && text.find('`', at + 1) == std::string_view::npos) {
          out += "\\(ga";
          break;
        }
        bold = !bold;
        out += bold ? "\\fB" : "\\fR";
        break;
      case '\\':
        out += "\\e";
        break;
      case '-':
        out += "\\-";
        break;
      case '\'':
        out += "\\(aq";
        break;
      case '^':
        out += "\\(ha";
        break;
      case '~':
        out += "\\(ti";
        break;
      default:
        out += text[at];
    }
  }
  return out.starts_with('.') ? "\\&" + out : out;
}

std::vector<std::string> lines_of(const std::string& text) {
  return CLI::detail::split(text, '\n');
}

/// Fills paragraphs. Lines indented by two spaces stay lines.
std::string paragraphs(const std::string& text) {
  std::string out;
  bool filled = true, begun = false;  // begun: the paragraph has a line
  for (const std::string& line : lines_of(text)) {
    if (line.empty()) {
      begun = false;
      continue;
    }
    if (line.starts_with("  ")) {
      out += filled ? ".PP\n.nf\n" : begun ? "" : "\n";
      filled = false;
    } else {
      out += filled ? begun ? "" : ".PP\n" : ".fi\n.PP\n";
      filled = true;
    }
    begun = true;
    out += escaped(line) + "\n";
  }
  return out + (filled ? "" : ".fi\n");
}

/// Drops a first .PP, because a section begins with a paragraph anyway.
std::string section(const std::string& title, const std::string& text) {
  constexpr std::string_view kParagraph = ".PP\n";
  return fmt::format(".SH {}\n{}", title, text.substr(text.starts_with(kParagraph) ? kParagraph.size() : 0));
}

/// "\fB\-o\fR, \fB\-\-output\fR \fIFILE\fR".
std::string heading(const OptionDoc& option) {
  std::vector<std::string> names;
  for (const std::string& name : option.names) {
    names.push_back(fmt::format("\\fB{}\\fR", escaped(name)));
  }
  return option.value.empty() ? fmt::format("{}", fmt::join(names, ", "))
                              : fmt::format("{} \\fI{}\\fR", fmt::join(names, ", "), escaped(option.shown_value()));
}

std::string entry(const std::string& title, const OptionDoc& option) {
  std::string text = option.text;
  if (!option.default_value.empty()) {
    text += fmt::format(" (default: {})", option.default_value);
  }
  std::string body = escaped(text);
  if (!option.variable.empty()) {
    body += fmt::format("; also by the variable \\fB{}\\fR", escaped(option.variable));
  }
  return fmt::format(".TP\n{}\n{}\n", title, body);
}

std::string synopsis(const CommandDoc& command) {
  std::string line = fmt::format("\\fB{}\\fR [\\fIOPTIONS\\fR]", escaped(command.words()));
  for (const OptionDoc& position : command.positions) {
    const std::string name =
        fmt::format("\\fI{}\\fR{}", escaped(position.names.front()), position.repeats ? " ..." : "");
    line += position.required ? " " + name : fmt::format(" [{}]", name);
  }
  if (!command.commands.empty()) {
    line += command.needs_command ? " \\fICOMMAND\\fR" : " [\\fICOMMAND\\fR]";
  }
  return line;
}

/// Each group with its title as a subsection.
std::string option_groups(const std::vector<OptionDoc>& options) {
  std::vector<std::string> groups;
  for (const OptionDoc& option : options) {
    if (std::ranges::find(groups, option.group) == groups.end()) {
      groups.push_back(option.group);
    }
  }
  std::string out;
  for (const std::string& group : groups) {
    out += group == "Options" ? "" : fmt::format(".SS {}\n", escaped(group));
    for (const OptionDoc& option : options) {
      out += option.group == group ? entry(heading(option), option) : "";
    }
  }
  return out;
}

std::string command_section(const CommandDoc& command, const CommandDoc& program,
                            const std::vector<OptionDoc>& shared) {
  std::string out = fmt::format(
      ".SS {}\n{}\n", escaped(fmt::format("{}", fmt::join(command.path.begin() + 1, command.path.end(), " "))),
      synopsis(command));
  out += paragraphs(command.about);
  for (const OptionDoc& position : command.positions) {
    out += entry(fmt::format("\\fI{}\\fR", escaped(position.names.front())), position);
  }
  std::vector<std::string> also;
  for (const OptionDoc& option : command.options) {
    if (std::ranges::find(program.options, option) != program.options.end() && option.names.back() != kHelpFlag) {
      continue;  // described there
    }
    if (std::ranges::find(shared, option) != shared.end()) {
      also.push_back(fmt::format("\\fB{}\\fR", escaped(option.names.back())));
    } else {
      out += entry(heading(option), option);
    }
  }
  if (!also.empty()) {
    out += fmt::format(".PP\nAnd, as told below: {}.\n", fmt::join(also, ", "));
  }
  return out + paragraphs(command.footer);
}

std::string environment(const std::vector<const CommandDoc*>& commands) {
  std::vector<std::string> told;
  std::string out;
  for (const CommandDoc* command : commands) {
    for (const OptionDoc& option : command->options) {
      if (!option.variable.empty() && std::ranges::find(told, option.variable) == told.end()) {
        told.push_back(option.variable);
        out += fmt::format(".TP\n\\fB{}\\fR\nas \\fB{}\\fR\n", escaped(option.variable), escaped(option.names.back()));
      }
    }
  }
  return out.empty() ? "" : ".SH ENVIRONMENT\n" + out;
}

/// The description up to its first stop.
std::string summary(const std::string& about) {
  return about.substr(0, about.find_first_of(".:\n"));
}

}  // namespace

std::string man_page(const CommandDoc& program, const std::string& version, const std::string& date) {
  std::string title = program.name();
  std::ranges::transform(title, title.begin(), [](unsigned char letter) { return std::toupper(letter); });
  std::string page = fmt::format(".\\\" Made from the program's own help by `{} --describe man`.\n", program.name());
  page += fmt::format(".TH {} 1 \"{}\" \"Lightmill {}\" \"Lightmill\"\n", escaped(title), date, escaped(version));
  page += fmt::format(".SH NAME\n{} \\- {}\n", escaped(program.name()), escaped(summary(program.about)));
  page += fmt::format(".SH SYNOPSIS\n{}\n", synopsis(program));
  page += section("DESCRIPTION", paragraphs(program.about));
  page += ".SH OPTIONS\n" + option_groups(program.options);
  const std::vector<const CommandDoc*> commands = all_commands(program);
  if (commands.size() > 1) {
    const std::vector<OptionDoc> shared = shared_options({commands.begin() + 1, commands.end()});
    page += ".SH COMMANDS\n";
    for (const CommandDoc* command : commands) {
      page += command == &program ? "" : command_section(*command, program, shared);
    }
    if (!shared.empty()) {
      page += ".SH OPTIONS OF SEVERAL COMMANDS\n" + option_groups(shared);
    }
  }
  page += environment(commands);
  page += program.footer.empty() ? "" : section("NOTES", paragraphs(program.footer));
  page += ".SH SEE ALSO\n";
  std::vector<std::string> others{"lightmill", "lightmill-server", "lightmill-worker"};
  std::erase(others, program.name());
  for (std::string& other : others) {
    other = fmt::format("\\fB{}\\fR(1)", escaped(other));
  }
  return page + fmt::format("{}\n", fmt::join(others, ", "));
}

}  // namespace lightmill

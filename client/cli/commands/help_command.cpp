// lightmill help [COMMAND | TOPIC]
#include <algorithm>

#include "client/cli/context.h"
#include "client/cli/help_topics.h"
#include "common/base/suggestion.h"
#include "common/command_line/help_page.h"

namespace lightmill::cli {
namespace {

/// "`lightmill help workers`."
std::string help_of(const std::vector<std::string>& words) {
  return fmt::format("`lightmill help{}{}`.", words.empty() ? "" : " ", fmt::join(words, " "));
}

Status explain(const CLI::App& app, const std::vector<std::string>& words, const Console& console) {
  const CLI::App* command = &app;
  for (const std::string& word : words) {
    const std::vector<const CLI::App*> below = command->get_subcommands(
        [&](const CLI::App* each) { return each->get_name() == word && !each->get_group().empty(); });
    const auto topic = std::ranges::find(help_topics(), word, &HelpTopic::name);
    if (!below.empty()) {
      command = below.front();
    } else if (words.size() == 1 && topic != help_topics().end()) {
      topic->explain(console);
      return ok_status();
    } else {
      const CommandDoc doc = command_of(*command);
      const std::vector<std::string> known(doc.path.begin() + 1, doc.path.end());
      if (topic != help_topics().end() || (!known.empty() && doc.commands.empty())) {
        return invalid_argument("`lightmill help` explains one command or topic at a time, got '{}'\nTry {}",
                                fmt::join(words, " "), help_of(known.empty() ? std::vector{word} : known));
      }
      std::vector<std::string> names;
      for (const CommandDoc& each : doc.commands) {
        names.push_back(each.name());
      }
      if (known.empty()) {
        const std::vector<std::string_view> topics = help_topic_names();
        names.insert(names.end(), topics.begin(), topics.end());
      }
      return invalid_argument("unknown command{} '{}'{}\nTry {}", known.empty() ? " or topic" : "",
                              fmt::join(words, " "), did_you_mean(word, names), help_of(known));
    }
  }
  std::string page = help_page_for_terminal(*command);
  page.pop_back();  // the final line feed
  console.result(page);
  return ok_status();
}

std::string topics_text() {
  std::string text = "`lightmill help TOPIC` explains a topic:\n\n";
  for (const HelpTopic& topic : help_topics()) {
    text += fmt::format("  {:<10}  {}\n", topic.name, topic.about);
  }
  text.pop_back();  // the final line feed
  return text;
}

}  // namespace

void add_help_command(CLI::App& app, Context& context) {
  const auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* command = app.add_subcommand("help", "Explain a command or a topic.");
  command->footer(topics_text());
  command->add_option("COMMAND", *words, "a command, as in `lightmill help workers drain`, or a topic");
  command->callback([&app, &context, words] {
    context.run = [&app, words](const Console& console) {
      const Status status = explain(app, *words, console);
      return status.ok() ? kDone : console.fail(status);
    };
  });
}

}  // namespace lightmill::cli

#include "common/command_line/describe_option.h"

#include <nlohmann/json.hpp>

#include "common/command_line/help_page.h"

namespace lightmill {
namespace {

nlohmann::ordered_json described(const OptionDoc& option) {
  return {{"names", option.names},           {"value", option.value},       {"text", option.text},
          {"default", option.default_value}, {"variable", option.variable}, {"group", option.group},
          {"required", option.required},     {"repeats", option.repeats},   {"value_optional", option.value_optional}};
}

nlohmann::ordered_json described(const CommandDoc& command);

template <typename Doc>
nlohmann::ordered_json all_described(const std::vector<Doc>& docs) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const Doc& doc : docs) {
    all.push_back(described(doc));
  }
  return all;
}

nlohmann::ordered_json described(const CommandDoc& command) {
  return {{"words", command.words()},
          {"about", command.about},
          {"footer", command.footer},
          {"usage", usage_of(command)},
          {"positions", all_described(command.positions)},
          {"options", all_described(command.options)},
          {"commands", all_described(command.commands)},
          {"needs_command", command.needs_command}};
}

}  // namespace

void add_describe_option(CLI::App& app, const std::string& version) {
  app.add_flag_callback(
         "--describe",
         [&app, version] {
           const nlohmann::ordered_json all{{"version", version}, {"program", described(command_tree(app))}};
           throw CLI::CallForVersion(all.dump(1), 0);
         })
      ->group("");
}

}  // namespace lightmill

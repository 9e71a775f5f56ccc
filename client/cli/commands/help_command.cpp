// lightmill help [COMMAND | TOPIC]
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/table.h"
#include "common/base/text_width.h"
#include "common/command_line/help_page.h"
#include "common/command_line/usage_errors.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill::cli {
namespace {

constexpr const char* kMethodsTopic = "methods";
constexpr const char* kExitCodesTopic = "exit-codes";

void explain_methods(const Console& console) {
  Rows rows{{"METHOD", "SHOWS", "PARAMETERS"}};
  for (const MethodAbout& about : method_abouts()) {
    rows.push_back({std::string(about.name), std::string(about.summary), std::string(about.parameters)});
  }
  print_table(console, rows);
  console.result("");
  print_table(console,
              {{"PARAMETER", "MEANS"},
               {"photons=N", "photons of a pass, one pass for each sample (default: one for 16 pixels; vcm: for 4)"},
               {"radius=C", "gather radius of the first pass, in pixels (default: 1.5; vcm: 0.5; ppm: 3)"},
               {"caustic", "only photons that have met a mirror or glass first"},
               {"no-absorption", "media inside shapes absorb no light"},
               {"distance=D", "maximum distance of occluders, in scene units (default: unlimited)"},
               {"flat", "shades with geometric normals"},
               {"glass=R", "constant reflectance of smooth glass, instead of Fresnel's equations"},
               {"brute-force", "tests every triangle for every ray, to measure what the BVH saves"}});
  console.result("");
  console.result("lightmill render scene.json --method caustic:photons=50000,radius=1 -o picture.exr");
}

void explain_exit_codes(const Console& console) {
  print_table(console, {{"CODE", "MEANS"},
                        {"0", "done"},
                        {"1", "the job failed, or a check found a difference"},
                        {"2", "bad usage or bad input"},
                        {"3", "the farm is unreachable or full: try again later"},
                        {"130", "interrupted"}});
}

Status explain(const CLI::App& app, const std::vector<std::string>& words, const Console& console) {
  const CLI::App* command = &app;
  for (const std::string& word : words) {
    const std::vector<const CLI::App*> below = command->get_subcommands(
        [&](const CLI::App* each) { return each->get_name() == word && !each->get_group().empty(); });
    if (!below.empty()) {
      command = below.front();
    } else if (command == &app && word == kMethodsTopic) {
      explain_methods(console);
      return ok_status();
    } else if (command == &app && word == kExitCodesTopic) {
      explain_exit_codes(console);
      return ok_status();
    } else {
      std::vector<std::string> names;
      for (const CommandDoc& each : command_of(*command).commands) {
        names.push_back(each.name());
      }
      if (command == &app) {
        names.insert(names.end(), {kMethodsTopic, kExitCodesTopic});
      }
      return invalid_argument("unknown command or topic '{}'{}", word, did_you_mean(word, names));
    }
  }
  std::string page = help_page_for_terminal(*command);
  page.pop_back();  // the final line feed
  console.result(page);
  return ok_status();
}

}  // namespace

void add_help_command(CLI::App& app, Context& context) {
  const auto words = std::make_shared<std::vector<std::string>>();
  CLI::App* command = app.add_subcommand("help", "Explain a command, or a topic: methods, exit-codes.");
  command->add_option("COMMAND", *words, "a command, as in `lightmill help workers drain`, or a topic");
  command->callback([&app, &context, words] {
    context.run = [&app, words](const Console& console) {
      const Status status = explain(app, *words, console);
      return status.ok() ? kDone : console.fail(status);
    };
  });
}

}  // namespace lightmill::cli

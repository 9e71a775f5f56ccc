#include "client/cli/context.h"

namespace lightmill::cli {

void add_json_option(CLI::App& command, Context& context) {
  command.add_flag("--json", context.common.json, "print one JSON object instead of text");
}

void add_common_options(CLI::App& command, Context& context) {
  command
      .add_option("--server", context.common.server,
                  "the farm's address (default: $LIGHTMILL_SERVER, else 127.0.0.1:7350)")
      ->type_name("HOST:PORT");
  add_json_option(command, context);
}

}  // namespace lightmill::cli

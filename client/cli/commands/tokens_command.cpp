// lightmill tokens [create | revoke]
#include <algorithm>
#include <nlohmann/json.hpp>
#include <tuple>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/base/file.h"
#include "common/security/certificate.h"
#include "common/security/token.h"
#include "common/wire/role_proto.h"

namespace lightmill::cli {
namespace {

using nlohmann::json;

constexpr std::uint64_t kMaxTokenDays = 3'650;

struct TokenOptions {
  std::string name, id, roles = "view,submit", out;
  std::uint64_t days = 90;
};

Result<json> token_json(const v1::Token& token) {
  LM_ASSIGN_OR_RETURN(const Roles roles, roles_from_wire(token.roles()));
  json names = json::array();
  for (const Role role : kRoles) {
    if (roles.has(role)) {
      names.push_back(name_of(role));
    }
  }
  return json{{"id", token.id()},
              {"name", token.name()},
              {"roles", names},
              {"made_by", token.made_by()},
              {"made", date_text(token.made_unix_s())},
              {"until", date_text(token.until_unix_s())},
              {"ended", token.until_unix_s() <= now_unix_s()}};
}

Status create(FarmConnection& connection, const Console& console, const TokenOptions& options) {
  LM_ASSIGN_OR_RETURN(const Roles roles, parse_roles(options.roles));
  LM_ASSIGN_OR_RETURN(const NewToken made, make_token());
  v1::CreateTokenRequest request;
  request.set_id(made.id);
  request.set_sha256(std::string(made.hash.bytes.begin(), made.hash.bytes.end()));
  request.set_name(options.name);
  to_wire(roles, request.mutable_roles());
  request.set_until_unix_s(now_unix_s() + static_cast<std::int64_t>(options.days) * kDaySeconds);
  if (!options.out.empty()) {  // first: a token that cannot be handed over is of no use
    LM_RETURN_IF_ERROR(write_secret_file(options.out, as_byte_view(made.text + "\n"), false));
  }
  const Result<v1::Token> token = connection.create_token(request);
  if (!token.ok()) {
    if (!options.out.empty()) {
      std::error_code ignored;
      std::filesystem::remove(options.out, ignored);
    }
    return token.status();
  }
  LM_ASSIGN_OR_RETURN(json object, token_json(*token));
  object[options.out.empty() ? "token" : "file"] = options.out.empty() ? made.text : options.out;
  console.object(object);
  console.notice(fmt::format("token {} stands for '{}' ({}) until {}{}", made.id, options.name, names_of(roles),
                             date_text(token->until_unix_s()), options.out.empty() ? "; it is shown this once" : ""));
  console.result(options.out.empty() ? made.text : fmt::format("{}: the token", options.out));
  return ok_status();
}

Status list(FarmConnection& connection, const Console& console) {
  LM_ASSIGN_OR_RETURN(std::vector<v1::Token> tokens, connection.list_tokens());
  std::ranges::sort(tokens, {},
                    [](const v1::Token& token) { return std::tuple(token.name(), token.made_unix_s(), token.id()); });
  json objects = json::array();
  std::vector<std::vector<std::string>> rows{{"ID", "NAME", "ROLES", "MADE", "BY", "UNTIL"}};
  for (const v1::Token& token : tokens) {
    LM_ASSIGN_OR_RETURN(objects.emplace_back(), token_json(token));
    LM_ASSIGN_OR_RETURN(const Roles roles, roles_from_wire(token.roles()));
    rows.push_back({token.id(), token.name(), names_of(roles), date_text(token.made_unix_s()),
                    token.made_by().empty() ? "-" : token.made_by(),
                    date_text(token.until_unix_s()) + (token.until_unix_s() <= now_unix_s() ? " (ended)" : "")});
  }
  console.object(json{{"tokens", objects}});
  if (tokens.empty()) {
    console.result("no tokens: `lightmill tokens create NAME` makes one");
  } else {
    print_table(console, rows);
  }
  return ok_status();
}

Status revoke(FarmConnection& connection, const Console& console, const std::string& id) {
  LM_RETURN_IF_ERROR(connection.revoke_token(id));
  console.object(json{{"id", id}, {"revoked", true}});
  console.result(fmt::format("nobody gets in by token {} any more", id));
  return ok_status();
}

void run_it(CLI::App* command, Context& context, const std::function<Status(FarmConnection&, const Console&)>& action) {
  add_common_options(*command, context);
  command->callback([&context, command, action] {
    if (!command->get_subcommands().empty()) {
      return;  // its own callback has run
    }
    context.run = [&context, action](const Console& console) {
      return with_farm(console, context.common,
                       [&](FarmConnection& connection) { return action(connection, console); });
    };
  });
}

}  // namespace

void add_token_commands(CLI::App& app, Context& context) {
  const auto options = std::make_shared<TokenOptions>();
  CLI::App* tokens =
      app.add_subcommand("tokens", "List the tokens that let in who has no certificate, or make or revoke one.");
  tokens->require_subcommand(0, 1);
  tokens->footer(
      "For the role admin. A token is given in a file (--token-file) or in LIGHTMILL_TOKEN; docs/security.md says "
      "more.");
  run_it(tokens, context, list);

  CLI::App* made = tokens->add_subcommand("create", "Make a token, and print it this once.");
  made->add_option("NAME", options->name, "whom it stands for; the owner of the jobs that are submitted with it")
      ->required();
  made->add_option("--roles", options->roles,
                   "what its bearer may do: view, submit, operate, worker, admin; with commas")
      ->type_name("ROLE[,ROLE]")
      ->check(readable(parse_roles))
      ->capture_default_str();
  made->add_option("--days", options->days, "how long it holds")
      ->check(whole_number(1, kMaxTokenDays))
      ->capture_default_str();
  made->add_option("--out", options->out, "write it here, for its owner's eyes alone, instead of printing it")
      ->type_name("FILE");
  run_it(made, context, [options](FarmConnection& connection, const Console& console) {
    return create(connection, console, *options);
  });

  CLI::App* revoked = tokens->add_subcommand("revoke", "Let nobody in by a token any more.");
  revoked->add_option("ID", options->id, "as `tokens` lists it")->required();
  run_it(revoked, context, [options](FarmConnection& connection, const Console& console) {
    return revoke(connection, console, options->id);
  });
}

}  // namespace lightmill::cli

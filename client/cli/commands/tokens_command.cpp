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

constexpr std::uint64_t kMaxTokenDays = 3'650, kMaxEnrolments = 10'000;
constexpr std::uint64_t kDays = 90, kEnrolmentDays = 7;
/// A token with less time left is announced.
constexpr std::int64_t kSoonSeconds = 14 * kDaySeconds;

struct TokenOptions {
  std::string name, id, roles = "view,submit", out;
  std::uint64_t days = 0;        ///< 0: the default
  std::uint64_t enrolments = 0;  ///< workers that it enrols; 0: it has the roles
  std::uint64_t worker_days = 365;
  bool enrolled = false;
};

Result<json> token_json(const v1::Token& token) {
  LM_ASSIGN_OR_RETURN(const Roles roles, roles_from_wire(token.roles()));
  json names = json::array();
  for (const Role role : kRoles) {
    if (roles.has(role)) {
      names.push_back(name_of(role));
    }
  }
  json object{{"id", token.id()},
              {"name", token.name()},
              {"roles", names},
              {"made_by", token.made_by()},
              {"made", date_text(token.made_unix_s())},
              {"until", date_text(token.until_unix_s())},
              {"ended", token.until_unix_s() <= now_unix_s()}};
  if (roles.has(Role::enrol)) {
    object["enrolment"] = {{"workers", token.enrolment().workers()},
                           {"enrolled", token.enrolment().enrolled()},
                           {"worker_days", token.enrolment().worker_seconds() / kDaySeconds}};
  }
  if (!token.enrolled_by().empty()) {
    object["enrolled_by"] = token.enrolled_by();
  }
  return object;
}

/// The purpose of a new token, in words.
std::string purpose_of(const v1::Token& token, Roles roles) {
  return roles.has(Role::enrol) ? fmt::format("It enrols {} as '{}/HOST'. Their tokens last {}",
                                              counted(token.enrolment().workers(), "worker"), token.name(),
                                              counted(token.enrolment().worker_seconds() / kDaySeconds, "day"))
                                : fmt::format("It belongs to '{}' (roles: {})", token.name(), names_of(roles));
}

Status create(CoordinatorClient& connection, const Console& console, const TokenOptions& options) {
  const bool enrols = options.enrolments > 0;
  LM_ASSIGN_OR_RETURN(const Roles roles, enrols ? Roles{Role::enrol} : parse_roles(options.roles));
  LM_ASSIGN_OR_RETURN(const NewToken made, make_token());
  v1::CreateTokenRequest request;
  request.set_id(made.id);
  request.set_sha256(std::string(made.hash.bytes.begin(), made.hash.bytes.end()));
  request.set_name(options.name);
  to_wire(roles, request.mutable_roles());
  if (enrols) {
    request.mutable_enrolment()->set_workers(static_cast<std::uint32_t>(options.enrolments));
    request.mutable_enrolment()->set_worker_seconds(static_cast<std::int64_t>(options.worker_days) * kDaySeconds);
  }
  const std::uint64_t days = options.days > 0 ? options.days : enrols ? kEnrolmentDays : kDays;
  request.set_until_unix_s(now_unix_s() + static_cast<std::int64_t>(days) * kDaySeconds);
  if (!options.out.empty()) {  // checked first, because a token that cannot be written is useless
    const Status written = write_secret_file(options.out, as_byte_view(made.text + "\n"), false);
    if (written.code() == StatusCode::kAlreadyExists) {
      return already_exists("{}: give another file with --out, or move it away first. No token was made",
                            message_of(written));
    }
    LM_RETURN_IF_ERROR(written);
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
  console.notice(fmt::format("token {} is valid until {}{}. {}", made.id, human_date(1000 * token->until_unix_s()),
                             options.out.empty() ? " and shown only once" : "", purpose_of(*token, roles)));
  console.result(options.out.empty() ? made.text : fmt::format("{}: the token", options.out));
  return ok_status();
}

Status list(CoordinatorClient& connection, const Console& console) {
  LM_ASSIGN_OR_RETURN(std::vector<v1::Token> tokens, connection.list_tokens());
  std::ranges::sort(tokens, {},
                    [](const v1::Token& token) { return std::tuple(token.name(), token.made_unix_s(), token.id()); });
  json objects = json::array();
  std::vector<std::vector<std::string>> rows{{"ID", "NAME", "ROLES", "MADE", "BY", "UNTIL"}};
  std::vector<std::string> ending;
  for (const v1::Token& token : tokens) {
    LM_ASSIGN_OR_RETURN(objects.emplace_back(), token_json(token));
    LM_ASSIGN_OR_RETURN(const Roles roles, roles_from_wire(token.roles()));
    const std::string uses = roles.has(Role::enrol)
                                 ? fmt::format(" ({} of {})", token.enrolment().enrolled(), token.enrolment().workers())
                                 : "";
    const std::int64_t left_s = token.until_unix_s() - now_unix_s();
    if (!roles.has(Role::enrol) && left_s > 0 && left_s < kSoonSeconds) {
      ending.push_back(token.name());
    }
    rows.push_back(
        {token.id(), token.name(), names_of(roles) + uses, human_day(1000 * token.made_unix_s()),
         !token.enrolled_by().empty() ? "token " + token.enrolled_by()
         : token.made_by().empty()    ? "-"
                                      : token.made_by(),
         human_day(1000 * token.until_unix_s()) + (token.until_unix_s() <= now_unix_s() ? " (expired)" : "")});
  }
  console.object(json{{"tokens", objects}});
  if (tokens.empty()) {
    console.result("no tokens: make one with `lightmill tokens create NAME`");
  } else {
    print_table(console, rows);
  }
  if (!ending.empty()) {
    console.notice(fmt::format("{} within {} days: {}. docs/operate/security.md, \"Renew tokens\", says what to do",
                               ending.size() == 1 ? "a token expires" : fmt::format("{} tokens expire", ending.size()),
                               kSoonSeconds / kDaySeconds, fmt::join(ending, ", ")));
  }
  return ok_status();
}

Status revoke(CoordinatorClient& connection, const Console& console, const TokenOptions& options) {
  v1::RevokeTokenRequest request;
  request.set_id(options.id);
  request.set_enrolled(options.enrolled);
  LM_ASSIGN_OR_RETURN(const v1::RevokeTokenResponse response, connection.revoke_token(request));
  console.object(json{{"id", options.id},
                      {"revoked", true},
                      {"enrolled", response.enrolled()},
                      {"enrolled_revoked", options.enrolled},
                      {"enrols_again_by", response.enrols_again_by()}});
  const std::string enrolled = counted(response.enrolled(), "worker");
  console.result(
      fmt::format("token {} is revoked{}", options.id,
                  options.enrolled ? fmt::format(", and so are those of {} that it enrolled", enrolled) : ""));
  if (response.enrolled() > 0 && !options.enrolled) {
    console.notice(fmt::format(
        "the tokens of {} that it enrolled are still valid: revoke them too with `lightmill tokens revoke {} "
        "--enrolled`",
        enrolled, options.id));
  }
  if (!response.enrols_again_by().empty()) {
    console.notice(fmt::format(
        "its bearer can enrol again with token {0}. To keep it out, first run `lightmill tokens revoke {0}`, and then revoke its newest token "
        "(`lightmill tokens`)",
        response.enrols_again_by()));
  }
  return ok_status();
}

}  // namespace

void add_token_commands(CLI::App& app, Context& context) {
  const auto options = std::make_shared<TokenOptions>();
  CLI::App* tokens =
      app.add_subcommand("tokens", "List, make or revoke tokens, for users and workers without a certificate.");
  tokens->require_subcommand(0, 1);
  tokens->footer("Needs the role admin. `lightmill help access` says how programs show a token.");
  add_common_options(*tokens, context);
  ask_farm(*tokens, context, list);

  CLI::App* made = tokens->add_subcommand("create", "Make a token, and print it once.");
  made->add_option("NAME", options->name, "name of the user or worker, the owner of jobs submitted with it")
      ->required();
  made->add_option("--roles", options->roles,
                   "one or several of view, submit, operate, worker and admin, separated by commas")
      ->type_name("ROLE[,ROLE]")
      ->check(readable(parse_roles))
      ->capture_default_str();
  made->add_option(
          "--enrol", options->enrolments,
          "instead of roles: N workers can enrol with it for a token of their own (lightmill-worker --enrol-file). "
          "It has no other use")
      ->type_name("N")
      ->check(whole_number(1, kMaxEnrolments))
      ->excludes("--roles");
  made->add_option("--days", options->days,
                   fmt::format("days of validity (default: {}; with --enrol {})", kDays, kEnrolmentDays))
      ->type_name("N")
      ->check(whole_number(1, kMaxTokenDays));
  made->add_option("--worker-days", options->worker_days, "with --enrol: days of validity of the workers' tokens")
      ->type_name("N")
      ->check(whole_number(1, kMaxTokenDays))
      ->capture_default_str()
      ->needs("--enrol");
  made->add_option("--out", options->out, "write it to this file, readable only by its owner, instead of printing it")
      ->type_name("FILE");
  add_common_options(*made, context);
  ask_farm(*made, context, [options](CoordinatorClient& connection, const Console& console) {
    return create(connection, console, *options);
  });

  CLI::App* revoked = tokens->add_subcommand("revoke", "Revoke a token.");
  revoked->add_option("ID", options->id, "its id, as `tokens` prints it")->required();
  revoked->add_flag("--enrolled", options->enrolled,
                    "also revoke the tokens of all workers that it enrolled. The token itself may be revoked already");
  add_common_options(*revoked, context);
  ask_farm(*revoked, context, [options](CoordinatorClient& connection, const Console& console) {
    return revoke(connection, console, *options);
  });
}

}  // namespace lightmill::cli

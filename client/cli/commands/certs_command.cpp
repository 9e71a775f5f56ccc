// lightmill certs init | server | worker | person | show
#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli/context.h"
#include "client/cli/table.h"
#include "client/cli/units.h"
#include "common/base/file.h"
#include "common/security/authority.h"
#include "common/security/certificate.h"
#include "common/security/tls_files.h"

namespace lightmill::cli {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

/// Certificates are valid from a little earlier, for machines with a slow clock.
constexpr std::int64_t kClockSlackSeconds = 5 * 60;
constexpr std::uint64_t kMaxFileBytes = 1 << 20;
constexpr std::uint64_t kMaxCertificateDays = 36'500;
constexpr const char* kAuthorityCertificate = "ca.pem";
constexpr const char* kAuthorityKey = "ca.key";
constexpr const char* kDefaultRoles = "view,submit";

struct CertsOptions {
  std::string folder, file, out, roles;
  std::string name = "Lightmill farm";
  std::vector<std::string> hosts;
  std::uint64_t days = 365, authority_days = 3'650;
  bool replace = false;
};

Validity days_from_now(std::uint64_t days) {
  const std::int64_t now = now_unix_s();
  return {now - kClockSlackSeconds, now + static_cast<std::int64_t>(days) * kDaySeconds};
}

enum class Reader { owner, everybody };

bool holds_key(const std::string& pem) {
  return pem.find("PRIVATE KEY-----") != std::string::npos;
}

std::string_view kind_of(bool authority, bool hosts, const Roles& roles) {
  return authority                      ? "an authority's"
         : hosts                        ? "a coordinator's"
         : roles == Roles{Role::worker} ? "a worker's"
                                        : "a person's";
}

std::string_view kind_of(const CertificateSubject& subject) {
  return kind_of(false, !subject.hosts.empty(), subject.roles);
}

std::string_view kind_of(const CertificateFacts& facts) {
  return kind_of(facts.authority, !facts.hosts.empty(), facts.roles);
}

/// The content of a file, in words.
std::string what_is(const std::string& pem) {
  const Result<std::vector<CertificateFacts>> all = read_certificates(pem);
  if (!all.ok()) {
    return holds_key(pem) ? "a private key alone" : "no certificate";
  }
  return fmt::format("{} certificate, of '{}'{}", kind_of(all->front()), all->front().name,
                     holds_key(pem) ? "" : " and without its key");
}

/// The certificate in a file; empty if there is none.
std::optional<CertificateFacts> certificate_in(const fs::path& path) {
  const Result<std::string> pem = read_file(path, kMaxFileBytes);
  const auto all = pem.ok() ? read_certificates(*pem) : Result<std::vector<CertificateFacts>>(pem.status());
  return all.ok() ? std::optional(all->front()) : std::nullopt;
}

/// Whether this is a certificate with its key for the same subject. Names must match except for coordinators.
bool is_former_of(const CertificateSubject& subject, const std::string& pem) {
  const Result<std::vector<CertificateFacts>> all = read_certificates(pem);
  return all.ok() && holds_key(pem) && kind_of(all->front()) == kind_of(subject) &&
         (!subject.hosts.empty() || all->front().name == subject.name);
}

/// Whether the file is missing, or `is_former` accepts its content, so that --replace may overwrite it.
Status check_replaceable(const fs::path& path, const std::function<bool(const std::string&)>& is_former,
                         std::string_view wanted) {
  if (std::error_code error; !fs::exists(path, error)) {
    return ok_status();
  }
  LM_ASSIGN_OR_RETURN(const std::string there, read_file(path, kMaxFileBytes));
  return is_former(there) ? ok_status()
                          : failed_precondition("{} holds {}, not {}: move it away first. Nothing was changed",
                                                path.string(), what_is(there), wanted);
}

Status write(const fs::path& path, const std::string& text, bool replace, Reader reader = Reader::owner) {
  const Status status = reader == Reader::everybody && (replace || !fs::exists(path))
                            ? write_file_atomically(path, as_byte_view(text))
                            : write_secret_file(path, as_byte_view(text), replace);
  return status.code() == StatusCode::kAlreadyExists
             ? already_exists("{}: --replace overwrites it. Nothing was changed", message_of(status))
             : status;
}

bool is_authority(const std::string& pem) {
  const Result<std::vector<CertificateFacts>> all = read_certificates(pem);
  return all.ok() && all->front().authority;
}

json certificate_json(const CertificateFacts& facts) {
  json roles = json::array();
  for (const Role role : kRoles) {
    if (facts.roles.has(role)) {
      roles.push_back(name_of(role));
    }
  }
  return {{"name", facts.name},
          {"issuer", facts.issuer},
          {"authority", facts.authority},
          {"hosts", facts.hosts},
          {"roles", roles},
          {"from", date_text(facts.from_unix_s)},
          {"until", date_text(facts.until_unix_s)},
          {"sha256", facts.fingerprint.hex()}};
}

std::string what_for(const CertificateFacts& facts) {
  return facts.authority       ? "authority"
         : facts.hosts.empty() ? fmt::format("roles {}", names_of(facts.roles))
                               : fmt::format("coordinator at {}", fmt::join(facts.hosts, ", "));
}

// ---- making certificates ----

Status make_authority_in(const CertsOptions& options, const Console& console) {
  const fs::path folder = options.folder;
  std::error_code error;
  if (fs::create_directories(folder, error)) {
    fs::permissions(folder, fs::perms::owner_all, error);
  }
  if (error) {
    return invalid_argument("cannot make the folder {}: {}. Choose another one", folder.string(), error.message());
  }
  const fs::path certificate = folder / kAuthorityCertificate;
  if (!options.replace && fs::exists(certificate, error)) {  // its key may be elsewhere
    return already_exists(
        "there is an authority in {} already. Make new certificates with it. --replace makes another authority, and all "
        "certificates of this one become invalid. Nothing was changed",
        folder.string());
  }
  if (options.replace) {
    LM_RETURN_IF_ERROR(check_replaceable(certificate, is_authority, "an authority's certificate"));
    LM_RETURN_IF_ERROR(check_replaceable(folder / kAuthorityKey, holds_key, "an authority's key"));
  }
  LM_ASSIGN_OR_RETURN(const KeyAndCertificate made,
                      make_authority(options.name, days_from_now(options.authority_days)));
  LM_RETURN_IF_ERROR(write(folder / kAuthorityKey, made.key, options.replace));
  LM_RETURN_IF_ERROR(write(certificate, made.certificate, options.replace, Reader::everybody));
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> facts, read_certificates(made.certificate));
  json object = certificate_json(facts.front());
  object["file"] = certificate.string();
  object["key_file"] = (folder / kAuthorityKey).string();
  console.object(object);
  console.result(fmt::format("{}: '{}', an authority until {}", certificate.string(), facts.front().name,
                             human_date(1000 * facts.front().until_unix_s)));
  console.result(fmt::format("{}: its key. Anyone who has it can become admin. Keep it secret, ideally offline",
                             (folder / kAuthorityKey).string()));
  return ok_status();
}

Result<KeyAndCertificate> read_authority(const fs::path& folder) {
  KeyAndCertificate authority;
  const Result<std::string> key = read_file(folder / kAuthorityKey),
                            certificate = read_file(folder / kAuthorityCertificate);
  if (!certificate.ok()) {
    return make_error(certificate.status().code(), "no authority in {0}: {1}. Make one with `lightmill certs init {0}`",
                      folder.string(), message_of(certificate.status()));
  }
  if (!key.ok()) {
    return with_context(
        key.status(), fmt::format("the key of the authority in {} is missing: put {} back. If it is lost, see \"The CA "
                                  "key is lost\" in docs/operate/security.md",
                                  folder.string(), kAuthorityKey));
  }
  const std::string key_file = (folder / kAuthorityKey).string();
  LM_RETURN_IF_ERROR(with_context(check_secrecy(key_file, "the authority's key"), key_file));
  return KeyAndCertificate{*key, *certificate};
}

/// NAME.pem, if NAME is a plain file name.
Result<fs::path> own_file(const CertsOptions& options, const std::string& name) {
  if (!options.out.empty()) {
    return fs::path(options.out);
  }
  const bool plain = !name.empty() && name.front() != '.' && name.find('/') == std::string::npos &&
                     name + ".pem" != kAuthorityCertificate;
  return plain ? Result<fs::path>(fs::path(options.folder) / (name + ".pem"))
               : invalid_argument("'{}' is not usable as a file name: give one with --out", name);
}

Status issue(const CertsOptions& options, const CertificateSubject& subject, const std::string& file_name,
             const Console& console) {
  LM_ASSIGN_OR_RETURN(const KeyAndCertificate authority, read_authority(options.folder));
  LM_ASSIGN_OR_RETURN(const fs::path file, own_file(options, file_name));
  const std::optional<CertificateFacts> former = certificate_in(file);
  LM_RETURN_IF_ERROR(check_replaceable(  // first, because --replace would not help
      file, [&](const std::string& pem) { return is_former_of(subject, pem); },
      fmt::format("{} certificate, of '{}'", kind_of(subject), subject.name)));
  LM_ASSIGN_OR_RETURN(const KeyAndCertificate made, issue_certificate(authority, subject, days_from_now(options.days)));
  LM_RETURN_IF_ERROR(write(file, made.certificate + made.key, options.replace));
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> facts, read_certificates(made.certificate));
  json object = certificate_json(facts.front());
  object["file"] = file.string();
  console.object(object);
  console.result(fmt::format("{}: '{}', {}, until {}; with its private key", file.string(), facts.front().name,
                             what_for(facts.front()), human_date(1000 * facts.front().until_unix_s)));
  if (former && what_for(*former) != what_for(facts.front())) {
    console.notice(fmt::format("it was: {}", what_for(*former)));
  }
  return ok_status();
}

/// The roles of a person's certificate: those given, or those of the certificate that it replaces.
Result<Roles> roles_for(const CertsOptions& options) {
  if (options.roles.empty() && options.replace) {
    LM_ASSIGN_OR_RETURN(const fs::path file, own_file(options, options.name));
    if (const auto former = certificate_in(file); former && kind_of(*former) == "a person's") {
      return former->roles;
    }
  }
  return parse_roles(options.roles.empty() ? kDefaultRoles : options.roles);
}

Status show(const std::string& file, const Console& console) {
  LM_ASSIGN_OR_RETURN(const std::string pem, read_file(file));
  LM_ASSIGN_OR_RETURN(const std::vector<CertificateFacts> all, with_context(read_certificates(pem), file));
  json objects = json::array();
  Rows rows;
  for (const CertificateFacts& facts : all) {
    objects.push_back(certificate_json(facts));
    if (!rows.empty()) {
      rows.push_back({""});
    }
    std::ranges::move(Rows{{"name", facts.name},
                           {"for", what_for(facts)},
                           {"from", human_date(1000 * facts.from_unix_s)},
                           {"until", human_date(1000 * facts.until_unix_s)},
                           {"signed by", facts.issuer},
                           {"SHA-256", facts.fingerprint.hex()}},
                      std::back_inserter(rows));
    if (facts.until_unix_s <= now_unix_s()) {
      console.notice(fmt::format("the certificate of '{}' has expired", facts.name));
    }
  }
  console.object(json{{"certificates", objects}});
  print_table(console, rows);
  return ok_status();
}

// ---- options ----

using CertsAction = std::function<Status(const CertsOptions&, const Console&)>;

void run_it(CLI::App* command, Context& context, const std::shared_ptr<CertsOptions>& options,
            const CertsAction& action) {
  add_json_option(*command, context);
  command->callback([&context, options, action] {
    context.run = [options, action](const Console& console) {
      const Status status = action(*options, console);
      return status.ok() ? kDone : console.fail(status);
    };
  });
}

CLI::App* add_issuing(CLI::App& certs, CertsOptions& options, const char* name, const char* about) {
  CLI::App* command = certs.add_subcommand(name, about);
  command->add_option("DIR", options.folder, "the folder in which `certs init` made the authority")
      ->type_name("DIR")
      ->required();
  command->add_option("--days", options.days, "days of validity")
      ->type_name("N")
      ->check(whole_number(1, kMaxCertificateDays))
      ->capture_default_str();
  command->add_option("--out", options.out, "output file (default: in DIR, by its name)")->type_name("FILE.pem");
  command->add_flag("--replace", options.replace, "overwrite an existing certificate of this name, to renew it");
  return command;
}

}  // namespace

void add_certs_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<CertsOptions>();
  CLI::App* certs = app.add_subcommand("certs", "Make certificates for a farm's machines and people.");
  certs->require_subcommand(1);
  certs->footer("`lightmill help access` explains how programs use them.");

  CLI::App* init = certs->add_subcommand("init", "Make an authority. The farm trusts the certificates that it signs.");
  init->add_option("DIR", options->folder, "its folder; made if needed")->type_name("DIR")->required();
  init->add_option("--name", options->name, "its name")->type_name("NAME")->capture_default_str();
  init->add_option("--days", options->authority_days, "days of validity")
      ->type_name("N")
      ->check(whole_number(1, kMaxCertificateDays))
      ->capture_default_str();
  init->add_flag("--replace", options->replace, "overwrite an existing authority. Its certificates become invalid");
  run_it(init, context, options, make_authority_in);

  CLI::App* server = add_issuing(*certs, *options, "server", "Make a coordinator's certificate: DIR/server.pem.");
  server->add_option("HOST", options->hosts, "all host names and IP addresses of the coordinator")->required();
  run_it(server, context, options, [](const CertsOptions& given, const Console& console) {
    return issue(given, {given.hosts.front(), given.hosts, {}}, "server", console);
  });

  CLI::App* worker = add_issuing(*certs, *options, "worker", "Make a worker's certificate: DIR/NAME.pem.");
  worker->add_option("NAME", options->name, "name of the machine: use one certificate for each machine")->required();
  run_it(worker, context, options, [](const CertsOptions& given, const Console& console) {
    return issue(given, {given.name, {}, {Role::worker}}, given.name, console);
  });

  CLI::App* person = add_issuing(*certs, *options, "person", "Make a person's certificate: DIR/NAME.pem.");
  person->add_option("NAME", options->name, "name of the person, the owner of jobs submitted with it")->required();
  person
      ->add_option("--roles", options->roles,
                   "one or several of view, submit, operate, worker and admin, separated by commas")
      ->type_name("ROLE[,ROLE]")
      ->check(readable(parse_roles))
      ->default_str(fmt::format("{}; with --replace, those of the old certificate", kDefaultRoles));
  run_it(person, context, options, [](const CertsOptions& given, const Console& console) -> Status {
    LM_ASSIGN_OR_RETURN(const Roles roles, roles_for(given));
    if (roles.has(Role::enrol)) {
      return invalid_argument("--roles: the role enrol is only for tokens (lightmill tokens create NAME --enrol N)");
    }
    return issue(given, {given.name, {}, roles}, given.name, console);
  });

  CLI::App* shown = certs->add_subcommand("show", "Show the content of a certificate.");
  shown->add_option("FILE", options->file, "a file with a certificate")->type_name("FILE")->required();
  run_it(shown, context, options,
         [](const CertsOptions& given, const Console& console) { return show(given.file, console); });
}

}  // namespace lightmill::cli

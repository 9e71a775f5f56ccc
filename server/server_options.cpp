#include "server/server_options.h"

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <filesystem>

#include "common/base/address.h"
#include "common/command_line/describe_option.h"
#include "common/farm/job.h"
#include "server/store/postgres/postgres_store.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

std::string default_data_directory() {
  if (const char* xdg = std::getenv("XDG_DATA_HOME"); xdg != nullptr && *xdg == '/') {
    return (fs::path(xdg) / "lightmill").string();
  }
  if (const char* home = std::getenv("HOME"); home != nullptr && *home != '\0') {
    return (fs::path(home) / ".local" / "share" / "lightmill").string();
  }
  return "lightmill-data";
}

void add_access_options(CLI::App& app, ServerOptions& options) {
  const char* const group = "Access";
  app.add_option(kCertificateOption, options.tls.certificate,
                 "the coordinator's certificate: connections are encrypted, and callers have to show who they are")
      ->type_name("FILE")
      ->group(group);
  app.add_option(kKeyOption, options.tls.key, "its private key (default: in the certificate's file)")
      ->type_name("FILE")
      ->group(group);
  app.add_option(kAuthorityOption, options.tls.authority,
                 "the authority that signs workers' and people's certificates; without it, callers show tokens")
      ->type_name("FILE")
      ->group(group);
  app.add_flag("--authenticate", options.authenticate,
               "ask for tokens also without a certificate, where only programs of this machine can call")
      ->group(group);
  app.add_flag(
         "--insecure", options.insecure,
         "let everybody who reaches it do everything, also from other machines; without it, that takes certificates")
      ->group(group);
}

void add_page_options(CLI::App& app, ServerOptions& options) {
  const char* const group = "Page";
  app.add_option("--http", options.http,
                 "also serve a web page to watch and steer renders, and a JSON API, on this address, such as "
                 "127.0.0.1:7380; encrypted with --tls-cert, and then with a login")
      ->type_name("HOST:PORT")
      ->group(group);
  app.add_option("--http-name", options.http_names,
                 "a name by which the page is called, besides localhost, addresses and those in the certificate")
      ->type_name("HOST")
      ->group(group);
  app.add_option("--http-port-file", options.http_port_file, "write the page's port here once it is served")
      ->type_name("FILE")
      ->group(group);
  app.add_option("--pages", options.pages, "the folder of the page's files")
      ->type_name("DIR")
      ->default_str("lightmill-web beside this program")
      ->group(group);
}

/// Checks the options of the page. Strangers may reach it under the same conditions as the gRPC port.
Status check_page(const ServerOptions& options) {
  if (options.http.empty()) {
    const char* const alone = !options.http_port_file.empty() ? "--http-port-file"
                              : !options.http_names.empty()   ? "--http-name"
                                                              : nullptr;
    return alone == nullptr ? ok_status() : invalid_argument("{} is given without --http", alone);
  }
  Result<HostPort> address = parse_host_port(options.http);
  LM_RETURN_IF_ERROR(with_context(address.status(), "--http"));
  if (!is_loopback(address->host) && !options.tls.given() && !options.insecure) {
    return failed_precondition(
        "--http {}: others could use and stop this farm, and read what goes over the wire. Give it a certificate ({}; "
        "`lightmill certs` makes one, docs/operate/security.md says how), or leave the page to this machine "
        "(127.0.0.1): `ssh -L 7380:127.0.0.1:7380 THIS-MACHINE` brings it to your browser",
        options.http, kCertificateOption);
  }
  return ok_status();
}

/// FAILED_PRECONDITION if strangers can reach the coordinator, unless --insecure allows it. The message says what to
/// do.
Status check_access(const ServerOptions& options, const HostPort& listen) {
  if (options.tls.certificate.empty() && !options.tls.key.empty()) {
    return invalid_argument("{} is given without {}, the coordinator's own certificate", kKeyOption,
                            kCertificateOption);
  }
  if (options.tls.certificate.empty() && options.tls.given()) {
    return invalid_argument("{} is given without {}, the coordinator's own certificate", kAuthorityOption,
                            kCertificateOption);
  }
  if (options.tls.given()) {
    if (options.insecure) {
      return invalid_argument("--insecure and {} do not go together", kCertificateOption);
    }
    LM_ASSIGN_OR_RETURN(const TlsTexts texts, read_tls_files(options.tls, system_clock().unix_milliseconds() / 1000));
    return with_context(check_names_hosts(texts), fmt::format("{} {}", kCertificateOption, options.tls.certificate));
  }
  if (options.insecure && options.authenticate) {
    return invalid_argument("--insecure and --authenticate do not go together: others could read the tokens");
  }
  if (!is_loopback(listen.host) && !options.insecure) {
    return failed_precondition(
        "--listen {}: others could use and stop this farm, and read what goes over the wire. Give it certificates ({} "
        "and {}; `lightmill certs` makes them, docs/operate/security.md says how), or --insecure if the network keeps "
        "strangers out",
        options.listen, kCertificateOption, kAuthorityOption);
  }
  return ok_status();
}

Status of_option(const char* option, const Status& status) {
  return status.ok() ? status : make_error(status.code(), "{}: {}", option, message_of(status));
}

/// Checks that need more than one option.
Status check_options(const ServerOptions& options) {
  if (!options.store.empty()) {
    LM_RETURN_IF_ERROR(
        of_option("--store", options.store.starts_with("postgres://") || options.store.starts_with("postgresql://")
                                 ? check_postgres_url(options.store)
                                 : invalid_argument("must be postgres://USER@HOST/DATABASE")));
  }
  const Result<HostPort> address = parse_host_port(options.listen);
  LM_RETURN_IF_ERROR(of_option("--listen", address.status()));
  LM_RETURN_IF_ERROR(check_access(options, *address));
  LM_RETURN_IF_ERROR(check_page(options));
  if (options.health.empty() && !options.health_port_file.empty()) {
    return invalid_argument("--health-port-file is given without --health");
  }
  if (!options.health.empty()) {
    LM_RETURN_IF_ERROR(of_option("--health", parse_host_port(options.health).status()));
  }
  return options.heartbeat_seconds * 2 > options.lease_seconds
             ? invalid_argument("--lease-seconds {} is less than twice --heartbeat-seconds, which is {}",
                                options.lease_seconds, options.heartbeat_seconds)
             : ok_status();
}

}  // namespace

std::optional<int> parse_server_options(int argc, char** argv, ServerOptions& options) {
  CLI::App app{
      "The coordinator of a Lightmill farm: takes jobs from `lightmill`, hands them out to `lightmill-worker`s, keeps "
      "what they have rendered.\n\nStart one, then workers with --server HOST:PORT, then render with `lightmill render "
      "SCENE`.\nStop it with Ctrl-C or SIGTERM; started again on the same directory it goes on where it was.\n\n"
      "Several coordinators may be given one --store: one is at work, the others stand by and take over within "
      "seconds.\n",
      "lightmill-server"};
  app.footer("Exit codes: 0 it was stopped, 1 it cannot start or go on, 2 bad usage, 130 stopped at once.");
  app.set_version_flag("--version", fmt::format("lightmill-server {} ({})", LIGHTMILL_VERSION, kRendererVersion));
  add_describe_option(app, LIGHTMILL_VERSION);
  app.add_option(
         "--data", options.data,
         "directory of all its state; made if need be. With XDG_DATA_HOME, the default is "
         "lightmill in there. With --store, the record of the last commit alone is kept there, and nowhere by default")
      ->type_name("DIR")
      ->default_str("~/.local/share/lightmill");
  app.add_option("--store", options.store,
                 "keep all state in this PostgreSQL database instead: postgres://USER@HOST/DATABASE (a password in "
                 "~/.pgpass)")
      ->type_name("URL");
  app.add_flag("--accept-loss", options.accept_loss,
               "go on with a database that has lost commits which were acknowledged, and without them; else such a "
               "database is refused");
  app.add_option("--listen", options.listen, "address and port to listen on; port 0 takes a free one")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_option("--port-file", options.port_file, "write the port here once clients can connect")->type_name("FILE");
  app.add_option(
         "--health", options.health,
         "also answer health checks (grpc.health.v1) here, and nothing else, without encryption: for probes that "
         "show no certificate. A coordinator that stands by answers too, and says that it is not ready")
      ->type_name("HOST:PORT");
  app.add_option("--health-port-file", options.health_port_file, "write their port here once they are answered")
      ->type_name("FILE");
  add_page_options(app, options);
  add_access_options(app, options);
  add_log_options(app, options.log);
  add_limit(app, "--lease-seconds", options.lease_seconds, "SECONDS", {0.5, 3600.0},
            "a worker that is silent for so long loses its work");
  add_limit(
      app, "--heartbeat-seconds", options.heartbeat_seconds, "SECONDS", {0.1, 600.0},
      "how often workers say that they live, where they are few; where they are hundreds it is longer, by itself up to "
      "a quarter of --lease-seconds");
  add_limit(app, "--return-seconds", options.return_seconds, "SECONDS", {0.0, 3600.0},
            "after a start, running jobs wait so long for workers to return with the work that they hold");
  add_limit(app, "--unit-seconds", options.unit_seconds, "SECONDS", {0.05, 60.0},
            "how long a worker should work on one unit, at least");
  add_limit(app, "--tile-cpu-seconds", options.tile_cpu_seconds, "SECONDS", {1.0, 1e6},
            "CPU time that one range of samples of a tile may take. Beyond it, samples are given out one by one. A job "
            "fails if one sample takes longer for two workers with different certificates or tokens. A worker that "
            "sends nothing for twice as long loses its work");
  add_limit(
      app, "--results-rate", options.results_mib, "MIB", {1.0, 1e6},
      "a second at most, of results that all workers send together: the more of them there are, the longer is what "
      "each works on; longer still while results wait long for their acknowledgement");
  add_limit(
      app, "--film-gib", options.film_gib, "GIB", {0.001, 1024.0},
      "memory per job for nodes that are out or wait to be joined; by default 1, or a sixteenth of the memory that "
      "the coordinator may use")
      ->default_str("");
  add_limit(app, "--films-gib", options.films_gib, "GIB", {0.001, 65536.0},
            "memory of all films: those of jobs that have not ended, beyond which jobs are refused, and those of ended "
            "jobs that were used last; by default half of the memory that the coordinator may use")
      ->default_str("");
  add_limit(app, "--max-asset-gib", options.max_asset_gib, "GIB", {0.001, 1024.0}, "size of one asset");
  add_limit(app, "--max-assets-gib", options.max_assets_gib, "GIB", {0.001, 1e6}, "disk for all assets together");
  add_limit(app, "--max-jobs", options.max_jobs, "N", {1, 1'000'000}, "jobs that are kept");
  add_limit(app, "--user-jobs", options.user_jobs, "N", {1, 1'000'000}, "those of one user");
  add_limit(app, "--caller-requests", options.calls.requests_per_second, "N", {1.0, 1e6},
            "requests a second of one caller, ten times as many at once");
  add_limit(
      app, "--caller-streams", options.calls.streams_per_caller, "N", {1, 1'000'000},
      "assets under way, films under way, jobs that are watched, open pages and scalers that listen, of one caller: "
      "so many of each");
  add_limit(app, "--streams", options.calls.streams, "N", {1, 1'000'000},
            "assets under way, of all callers; fewer where the process may open few files");
  add_limit(app, "--wire-gib", options.wire_gib, "GIB", {kLeastWireGib, 65536.0},
            "memory for what is on its way; by default 4, or an eighth of the memory that the coordinator may use")
      ->default_str("");
  add_limit(app, "--max-workers", options.max_workers, "N", {1, 1'000'000},
            "workers that may be there; others say so, and ask again");
  add_limit(app, "--keep-days", options.keep_days, "DAYS", {0.0, 36'500.0},
            "jobs that ended so long ago are deleted; 0: never");
  add_limit(app, "--reserve-gib", options.reserve_gib, "GIB", {0.0, 65536.0},
            "with less space on the disk of --data no work is handed out; jobs say so, and go on by themselves");
  add_limit(app, "--log-entries", options.log_entries, "N", {100, 1'000'000},
            "actions that the farm's log keeps (`lightmill log`); of refusals and workers that came, a quarter each");
  add_limit(app, "--log-days", options.log_days, "DAYS", {1, 36'500}, "how long it keeps them at most");
  CLI::App* const check = app.add_subcommand("check", "compare all that is stored with its checksums, and stop");
  check->fallthrough()->footer(
      "Takes --data or --store. What is damaged is taken out; what can be rendered again is, by the next coordinator.\n"
      "No coordinator may be at work.\n"
      "Exit codes: 0 nothing is lost, 1 something is, or it cannot be looked through, 2 bad usage.");
  return parse_options(app, argc, argv, [&] {
    options.check = check->parsed();
    if (options.data.empty() && options.store.empty()) {
      options.data = default_data_directory();
    }
    return check_options(options);
  });
}

}  // namespace lightmill

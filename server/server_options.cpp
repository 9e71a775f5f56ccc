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

std::string default_data_folder() {
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
                 "the coordinator's certificate. With it, connections are encrypted and callers must authenticate")
      ->type_name("FILE")
      ->group(group);
  app.add_option(kKeyOption, options.tls.key, "its private key, if it is in a file of its own")
      ->type_name("FILE")
      ->group(group);
  app.add_option(kAuthorityOption, options.tls.authority,
                 "the authority that signs workers' and people's certificates. Without it, callers use tokens")
      ->type_name("FILE")
      ->group(group);
  app.add_flag("--authenticate", options.authenticate,
               "require tokens even without a certificate, if only programs on this machine can connect")
      ->group(group);
  app.add_flag("--insecure", options.insecure,
               "let everyone who reaches the coordinator do everything, also from other machines. Without it, --listen "
               "on other addresses than loopback needs --tls-cert")
      ->group(group);
}

void add_page_options(CLI::App& app, ServerOptions& options) {
  const char* const group = "Page";
  app.add_option("--http", options.http,
                 "also serve the web page and the JSON API on this address, such as 127.0.0.1:7380. With --tls-cert "
                 "they are encrypted and need a login")
      ->type_name("HOST:PORT")
      ->group(group);
  app.add_option("--http-name", options.http_names,
                 "a host name of the page, besides localhost, addresses and the names in the certificate")
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
        "--http {}: others could use and stop this farm, and read its traffic. Give it a certificate ({}; `lightmill "
        "certs` makes one, see docs/operate/security.md), or serve the page only on 127.0.0.1: `ssh -L "
        "7380:127.0.0.1:7380 THIS-MACHINE` brings it to your browser",
        options.http, kCertificateOption);
  }
  return ok_status();
}

/// FAILED_PRECONDITION if other machines can reach the coordinator, unless --insecure allows it. The message says what
/// to do.
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
      return invalid_argument("--insecure and {} cannot be combined", kCertificateOption);
    }
    LM_ASSIGN_OR_RETURN(const TlsTexts texts, read_tls_files(options.tls, system_clock().unix_milliseconds() / 1000));
    return with_context(check_names_hosts(texts), fmt::format("{} {}", kCertificateOption, options.tls.certificate));
  }
  if (options.insecure && options.authenticate) {
    return invalid_argument("--insecure and --authenticate cannot be combined: others could read the tokens");
  }
  if (!is_loopback(listen.host) && !options.insecure) {
    return failed_precondition(
        "--listen {}: others could use and stop this farm, and read its traffic. Give it certificates ({} and {}; "
        "`lightmill certs` makes them, see docs/operate/security.md), or --insecure if only people you trust "
        "reach this network",
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

/// Options of the coordinator and of `check`.
void add_state_options(CLI::App& app, ServerOptions& options, const char* data, const char* accept_loss) {
  app.add_option("--data", options.data,
                 std::string(data) +
                     "With XDG_DATA_HOME, the default is lightmill in that folder. With --store, it "
                     "holds only the commit chain, and has no default")
      ->type_name("DIR")
      ->default_str("~/.local/share/lightmill");
  app.add_option("--store", options.store,
                 "the PostgreSQL database that has all state instead: postgres://USER@HOST/DATABASE (a password in "
                 "~/.pgpass)")
      ->type_name("URL");
  app.add_flag("--accept-loss", options.accept_loss, accept_loss);
}

/// Addresses of gRPC and of health checks.
void add_listen_options(CLI::App& app, ServerOptions& options) {
  app.add_option("--listen", options.listen, "address and port to listen on (port 0: a free one)")
      ->type_name("HOST:PORT")
      ->capture_default_str();
  app.add_option("--port-file", options.port_file, "write the port here once clients can connect")->type_name("FILE");
  app.add_option(
         "--health", options.health,
         "also answer health checks (grpc.health.v1) here, and nothing else, without encryption: for probes without "
         "a certificate. A standby coordinator answers too, and says that it is not ready")
      ->type_name("HOST:PORT");
  app.add_option("--health-port-file", options.health_port_file, "write the port of --health here once it answers")
      ->type_name("FILE");
}

/// Leases, units and results.
void add_work_options(CLI::App& app, ServerOptions& options) {
  add_limit(app, "--lease-seconds", options.lease_seconds, "SECONDS", {0.5, 3600.0},
            "a worker that is silent for this time loses its work");
  add_limit(app, "--heartbeat-seconds", options.heartbeat_seconds, "SECONDS", {0.1, 600.0},
            "interval of workers' heartbeats. It grows so that all workers together send at most 500 a "
            "second, up to a quarter of --lease-seconds");
  add_limit(app, "--return-seconds", options.return_seconds, "SECONDS", {0.0, 3600.0},
            "after a restart, running jobs wait this long for workers to reconnect with their leases");
  add_limit(app, "--unit-seconds", options.unit_seconds, "SECONDS", {0.05, 60.0},
            "target time of a unit on its worker. Units are longer if results would exceed --results-rate, and shorter "
            "near the end of a job");
  add_limit(
      app, "--tile-cpu-seconds", options.tile_cpu_seconds, "SECONDS", {1.0, 1e6},
      "CPU time that a pilot, or one range of samples of a tile, may take. Beyond it, samples are leased one at a "
      "time. A job fails if its pilot or one sample takes longer for two workers with different certificates or "
      "tokens. A worker that sends nothing for twice as long loses its work");
  add_limit(app, "--results-rate", options.results_mib, "MIB/S", {1.0, 1e6},
            "limit of the results of all workers together. More workers get longer units, and still longer ones "
            "while results wait long for their acknowledgement");
}

/// Limits of films and assets.
void add_size_limits(CLI::App& app, ServerOptions& options) {
  add_limit(app, "--film-gib", options.job_film_gib, "GIB", {0.001, 1024.0},
            "memory per job for nodes that are being rendered or wait to be joined")
      ->default_str("1, or a sixteenth of the memory that the coordinator may use");
  add_limit(app, "--films-gib", options.all_films_gib, "GIB", {0.001, 65536.0},
            "memory of all films. Jobs whose films exceed it are refused. The rest keeps recently used films of "
            "ended jobs")
      ->default_str("half of the memory that the coordinator may use");
  add_limit(app, "--max-asset-gib", options.max_asset_gib, "GIB", {0.001, 1024.0}, "size of one asset");
  add_limit(app, "--max-assets-gib", options.max_assets_gib, "GIB", {0.001, 1e6}, "disk for all assets together");
  add_limit(app, "--user-disk-gib", options.user_disk_gib, "GIB", {0.001, 1e6},
            "disk for the films of one user's jobs, with ended ones. The assets that one user sends may have half as "
            "much, and at most half of --max-assets-gib")
      ->default_str("a third of the disk of --data; without authentication or with --store: no limit");
}

/// Limits of jobs, calls and workers.
void add_use_limits(CLI::App& app, ServerOptions& options) {
  add_limit(app, "--max-jobs", options.max_jobs, "N", {1, 1'000'000}, "stored jobs");
  add_limit(app, "--user-jobs", options.user_jobs, "N", {1, 1'000'000}, "stored jobs of one user");
  add_limit(app, "--user-priority", options.user_priority, "N", {0, 1'000'000},
            "the highest priority that a user without the role operate may give a job");
  add_limit(app, "--caller-requests", options.calls.requests_per_second, "N", {1.0, 1e6},
            "requests per second of one caller, and ten times as many in a burst");
  add_limit(app, "--caller-streams", options.calls.streams_per_caller, "N", {1, 1'000'000},
            "limit of one caller for each of: asset transfers, film transfers, watched jobs, open pages, listening "
            "autoscalers");
  add_limit(app, "--streams", options.calls.streams, "N", {1, 1'000'000},
            "asset transfers of all callers; fewer if the process may open few files");
  add_limit(app, "--wire-gib", options.wire_gib, "GIB", {kMinWireGib, 65536.0}, "memory for messages in transit")
      ->default_str("4, or an eighth of the memory that the coordinator may use");
  add_limit(app, "--max-workers", options.max_workers, "N", {1, 1'000'000},
            "connected workers. Further ones are refused, and try again");
  add_limit(app, "--http-seconds", options.http_seconds, "SECONDS", {1.0, 3600.0},
            "a connection of --http that is silent for this time is closed");
}

/// Limits of jobs, log entries and disk space.
void add_keeping_options(CLI::App& app, ServerOptions& options) {
  add_limit(app, "--keep-days", options.keep_days, "DAYS", {0.0, 36'500.0},
            "ended jobs are deleted after this time; 0: never");
  add_limit(
      app, "--reserve-gib", options.reserve_gib, "GIB", {0.0, 65536.0},
      "free space on the disk of --data below which the coordinator accepts no job or asset, and leases no work. Jobs "
      "say so, and resume by themselves");
  add_limit(app, "--log-entries", options.log_entries, "N", {100, 1'000'000},
            "limit of the action log (`lightmill log`): N changes, and a quarter of N for refusals and for connecting "
            "workers each. Newer entries replace the oldest");
  add_limit(app, "--log-days", options.log_days, "DAYS", {1, 36'500},
            "entries of the action log are deleted after this time");
}

const CLI::App& add_check_command(CLI::App& app, ServerOptions& options) {
  CLI::App* const check = app.add_subcommand("check", "Check all stored data against its checksums.");
  add_state_options(*check, options, "folder of all state. ",
                    "check even if the database has lost acknowledged commits. Otherwise such a database is refused");
  add_log_options(*check, options.log);
  check->footer(
      "No coordinator may be active. Damaged data is removed. When a coordinator starts, workers render it again, if possible."
      "\nExit codes: 0 nothing is lost, 1 something is lost or cannot be checked, 2 bad usage.\n\nExamples:\n"
      "  lightmill-server check --data /var/lib/lightmill");
  return *check;
}

}  // namespace

std::optional<int> parse_server_options(int argc, char** argv, ServerOptions& options) {
  CLI::App app{
      "The coordinator of a Lightmill farm: takes jobs from `lightmill`, gives them to `lightmill-worker`s in units, "
      "and stores the results.\n\nStart one, then workers with --server HOST:PORT, then render with `lightmill "
      "render SCENE`.\nStop it with Ctrl-C or SIGTERM. Started again on the same folder, it resumes.\n\nSeveral "
      "coordinators can share one --store: one is active, and a standby takes over within seconds.\n",
      "lightmill-server"};
  app.footer(
      "Exit codes: 0 it was stopped, 1 it cannot start or continue, 2 bad usage, 130 stopped at once.\n\nExamples:\n"
      "  lightmill-server --http 127.0.0.1:7380\n"
      "  lightmill-server --listen 0.0.0.0:7350 --tls-cert server.pem --tls-ca ca.pem");
  app.set_help_flag("-h,--help", "print this help");
  app.set_version_flag("--version", fmt::format("lightmill-server {} ({})", LIGHTMILL_VERSION, kRendererVersion),
                       "print the version");
  add_describe_option(app, LIGHTMILL_VERSION);
  add_state_options(app, options, "folder of all its state; created if missing. ",
                    "start even if the database has lost acknowledged commits, and continue without them. Otherwise "
                    "such a database is refused");
  add_listen_options(app, options);
  add_page_options(app, options);
  add_access_options(app, options);
  add_log_options(app, options.log);
  add_work_options(app, options);
  add_size_limits(app, options);
  add_use_limits(app, options);
  add_keeping_options(app, options);
  const CLI::App& check = add_check_command(app, options);
  return parse_options(app, argc, argv, [&] {
    options.check = check.parsed();
    if (options.data.empty() && options.store.empty()) {
      options.data = default_data_folder();
    }
    return check_options(options);
  });
}

}  // namespace lightmill

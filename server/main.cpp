// lightmill-server: the coordinator of a farm.
#include <absl/synchronization/mutex.h>
#include <sys/stat.h>

#include <iostream>

#include "common/base/address.h"
#include "common/base/file.h"
#include "common/base/log.h"
#include "common/base/machine_memory.h"
#include "common/base/mutex.h"
#include "common/base/out_of_memory.h"
#include "common/base/signals.h"
#include "common/security/certificate.h"
#include "server/access/connection_limiter.h"
#include "server/api/api_server.h"
#include "server/api/health.h"
#include "server/host_monitor.h"
#include "server/runtime/runtime.h"
#include "server/server_options.h"
#include "server/store/asset_folder.h"
#include "server/store/check_state.h"
#include "server/store/data_folder.h"
#include "server/store/postgres/postgres_store.h"
#include "server/store/sqlite/sqlite_store.h"
#include "server/web/web_server.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

constexpr auto kMonitorPause = std::chrono::milliseconds(500);
constexpr auto kCollectionPause = std::chrono::hours(1);

CoordinatorLimits limits_of(const ServerOptions& options) {
  CoordinatorLimits limits;
  limits.heartbeat_interval = from_seconds(options.heartbeat_seconds);
  limits.lease_duration = from_seconds(options.lease_seconds);
  limits.tile_cpu_seconds = options.tile_cpu_seconds;
  limits.restart_grace = from_seconds(options.return_seconds);
  limits.unit_seconds = options.unit_seconds;
  limits.result_bytes_per_second = options.results_mib * 1024 * 1024;
  limits.film_bytes_per_job = bytes_of_gib(options.job_film_gib);
  limits.film_bytes = bytes_of_gib(options.all_films_gib);
  limits.scene_bytes = bytes_of_gib(share_of_memory_gib(1.0 / 8, 4));
  limits.max_jobs = options.max_jobs;
  limits.max_jobs_per_owner = options.user_jobs;
  limits.max_workers = options.max_workers;
  limits.keep_ended = from_seconds(options.keep_days * 24 * 60 * 60);
  return limits;
}

/// Blocks main until a signal or a failure.
class StopRequest {
 public:
  /// The program ends with the first failure.
  void ask(const Status& why = ok_status()) {
    const MutexLock lock(mutex_);
    asked_ = true;
    failure_.Update(why);
    changed_.notify_all();
  }
  /// Waits for a request. Returns the failure, if one stops the program.
  Status wait() {
    const MutexLock lock(mutex_);
    while (!asked_) {
      changed_.wait(mutex_);
    }
    return failure_;
  }
  /// Waits for `pause` at most. True if nothing asked to stop.
  bool wait_for(std::chrono::milliseconds pause) {
    const MutexLock lock(mutex_);
    const auto until = std::chrono::steady_clock::now() + pause;
    while (!asked_ && changed_.wait_until(mutex_, until) == std::cv_status::no_timeout) {
    }
    return !asked_;
  }

 private:
  Mutex mutex_;
  CondVar changed_;
  bool asked_ LM_GUARDED_BY(mutex_) = false;
  Status failure_ LM_GUARDED_BY(mutex_);
};

/// All stored state, and the lock on it.
struct State {
  std::optional<DataFolder> data;
  std::unique_ptr<Store> store;
  std::unique_ptr<AssetStore> assets;
  std::string place;
};

/// Disk for the films of one user. Without authentication anyone can be any user, so a default would limit no user.
std::uint64_t user_disk_bytes(const ServerOptions& options) {
  constexpr std::uint64_t kDefaultPart = 3;
  if (options.user_disk_gib > 0) {
    return bytes_of_gib(options.user_disk_gib);
  }
  std::error_code error;
  const bool known = options.store.empty() && (options.tls.given() || options.authenticate);
  const std::uint64_t disk = known ? fs::space(options.data, error).capacity : 0;
  return known && !error ? disk / kDefaultPart : std::numeric_limits<std::uint64_t>::max();
}

AssetLimits asset_limits(const ServerOptions& options) {
  const std::uint64_t all = bytes_of_gib(options.max_assets_gib);
  return {.asset_bytes = bytes_of_gib(options.max_asset_gib),
          .total_bytes = all,
          .user_bytes = std::min(all, user_disk_bytes(options)) / 2,
          .reserve_bytes = bytes_of_gib(options.reserve_gib)};
}

Result<State> open_state(const ServerOptions& options, StopRequest& stop) {
  State state;
  if (!options.store.empty()) {
    PostgresOptions postgres;
    postgres.url = options.store;
    postgres.assets = asset_limits(options);
    postgres.read_only = options.check;
    postgres.accept_loss = options.accept_loss;
    if (!options.data.empty()) {
      LM_ASSIGN_OR_RETURN(state.data, DataFolder::open(options.data));
      postgres.chain = state.data->path() / "postgres-chain";
    }
    postgres.wait = [&](std::chrono::milliseconds pause) { return stop.wait_for(pause); };
    postgres.on_deposed = [&stop](const Status& why) { stop.ask(why); };
    LM_ASSIGN_OR_RETURN(PostgresStores stores, open_postgres(std::move(postgres)));
    state.store = std::move(stores.store);
    state.assets = std::move(stores.assets);
    state.place = std::move(stores.place);
    return state;
  }
  LM_ASSIGN_OR_RETURN(DataFolder data, DataFolder::open(options.data));
  LM_ASSIGN_OR_RETURN(state.store, open_sqlite_store(data.database_file(), {.accept_loss = options.accept_loss}));
  LM_ASSIGN_OR_RETURN(state.assets, open_asset_folder(data.assets_folder(), asset_limits(options)));
  state.place = data.path().string();
  state.data.emplace(std::move(data));
  return state;
}

/// Adds advice to an error of opening the state.
Status with_advice(const Status& status) {
  switch (status.code()) {
    case StatusCode::kResourceExhausted:
      return resource_exhausted("{}. Free space there and start again. Nothing is lost", message_of(status));
    case StatusCode::kDataLoss:
      return data_loss("{}. Restore a backup. docs/operate/backup.md (A damaged page) says when less is enough",
                       message_of(status));
    default:
      return status;
  }
}

/// Runs `lightmill-server check`. DATA_LOSS if something is lost for good.
Status check_stored(const ServerOptions& options, StopRequest& stop) {
  if (options.store.empty()) {
    // Opening would create a missing store. It refuses to if commits were acknowledged.
    const fs::path database = DataFolder::database_file_of(options.data);
    std::error_code error;
    if (const std::uintmax_t bytes = fs::file_size(database, error);
        (error || bytes == 0) && (options.accept_loss || !sqlite_has_acknowledged(database))) {
      return not_found("there is no farm in {}: lightmill.sqlite is {}. Name the coordinator's folder with --data",
                       options.data, error ? "missing" : "empty");
    }
  }
  if (!options.store.empty() && options.data.empty()) {
    std::cout << "without --data, the folder of a coordinator, lost commits are not noticed\n";
  }
  Result<State> state = open_state(options, stop);
  LM_RETURN_IF_ERROR(with_advice(state.status()));
  const Result<StateCheck> found = check_state(*state->store, *state->assets);
  LM_RETURN_IF_ERROR(with_advice(found.status()));
  const StateCheck& check = *found;
  for (const std::string& line : check.report) {
    std::cout << line << "\n";
  }
  if (const std::string conclusion = conclusion_of(check); !conclusion.empty()) {
    std::cout << conclusion << "\n";
  }
  return check.whole ? ok_status() : data_loss("{}: something is lost", state->place);
}

/// The folder of this program.
fs::path program_folder() {
  std::error_code error;
  return fs::read_symlink("/proc/self/exe", error).parent_path();
}

Status write_port(const std::string& file, int port) {
  return file.empty() ? ok_status() : write_file_atomically(file, as_byte_view(fmt::format("{}\n", port)));
}

/// Null if the options do not ask for one.
Result<std::unique_ptr<HealthPort>> open_health_port(const ServerOptions& options, std::size_t connections) {
  if (options.health.empty()) {
    return std::unique_ptr<HealthPort>();
  }
  LM_ASSIGN_OR_RETURN(std::unique_ptr<HealthPort> health, HealthPort::open(options.health, connections));
  LM_RETURN_IF_ERROR(write_port(options.health_port_file, health->port()));
  return health;
}

RuntimeOptions runtime_options(const ServerOptions& options, const DescriptorPlan& plan) {
  RuntimeOptions runtime;
  runtime.access.authenticates = options.tls.given() || options.authenticate;
  runtime.access.accepts_certificates = !options.tls.authority.empty();
  runtime.access.accepts_tokens = !options.insecure;
  runtime.access.user_priority = options.user_priority;
  CallLimitOptions& calls = runtime.access.calls;
  calls = options.calls;
  // Each stream may hold a file open. No caller may take all of them.
  calls.streams = std::min(calls.streams, static_cast<std::uint32_t>(plan.assets));
  calls.streams_per_caller = std::min(calls.streams_per_caller, std::max(calls.streams / 2, 1u));
  runtime.limits = limits_of(options);
  runtime.limits.film_bytes_per_owner = user_disk_bytes(options);
  runtime.log = {options.log_entries, options.log_days};
  if (options.insecure) {
    runtime.notices.push_back("this farm runs with --insecure: everyone who reaches it can use it and stop its jobs");
  }
  return runtime;
}

WebOptions web_options(const ServerOptions& options, const DescriptorPlan& plan) {
  const fs::path pages = options.pages.empty() ? program_folder() / "lightmill-web" : fs::path(options.pages);
  return {.listen = options.http,
          .pages = pages,
          .version = LIGHTMILL_VERSION,
          .tls = options.tls,
          .names = options.http_names,
          .open_to_all = options.insecure,
          .connections = plan.page,
          .file_bytes = bytes_of_gib(share_of_memory_gib(1.0 / 8, 2)),
          .view_bytes = bytes_of_gib(share_of_memory_gib(1.0 / 16, 1)),
          .timeout = from_seconds(options.http_seconds)};
}

/// A host at which callers reach an address of this machine: a name in the certificate, because callers compare it.
std::string shown_host(const std::string& host, const std::string& certificate_file) {
  if (host != "0.0.0.0" && host != "[::]") {
    return host;
  }
  const Result<std::string> pem = certificate_file.empty() ? Result<std::string>("") : read_file(certificate_file);
  const Result<std::vector<CertificateFacts>> facts = read_certificates(pem.value_or(""));
  return facts.ok() && !facts->front().hosts.empty() ? facts->front().hosts.front() : host_name();
}

Status serve(const ServerOptions& options, StopRequest& stop) {
  const std::uint64_t files = raise_file_limit();
  const DescriptorPlan plan = plan_descriptors(files);
  LM_ASSIGN_OR_RETURN(const std::unique_ptr<HealthPort> health, open_health_port(options, plan.health));
  Result<State> state = open_state(options, stop);
  if (!state.ok()) {
    return state.status().code() == StatusCode::kCancelled ? ok_status() : with_advice(state.status());
  }
  // Debian's Abseil checks gRPC's locks for deadlocks. This is too slow with thousands of connections.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
  if (plan.calls < options.max_workers) {
    spdlog::warn(
        "this process may have {} open files, so it accepts {} gRPC connections: some of {} workers (--max-workers) "
        "may be refused. Raise its hard limit (ulimit -Hn, LimitNOFILE=)",
        files, plan.calls, options.max_workers);
  }
  const auto on_fatal = [&stop](const Status& why) { stop.ask(why); };
  RuntimeOptions wanted = runtime_options(options, plan);
  wanted.on_fatal = on_fatal;
  Result<std::unique_ptr<Runtime>> started = Runtime::start(std::move(state->store), std::move(state->assets), wanted);
  LM_RETURN_IF_ERROR(with_advice(started.status()));
  const std::unique_ptr<Runtime> runtime = *std::move(started);
  ApiOptions served{.listen = options.listen,
                    .connections = plan.calls,
                    .tls = options.tls,
                    .wire_bytes = bytes_of_gib(options.wire_gib),
                    .on_fatal = on_fatal};
  if (health != nullptr) {
    served.on_ready = [&health](bool ready) { health->set_ready(ready); };
  }
  LM_ASSIGN_OR_RETURN(std::unique_ptr<ApiServer> api, ApiServer::start(*runtime, served));
  std::unique_ptr<WebServer> web;
  if (!options.http.empty()) {
    LM_ASSIGN_OR_RETURN(web, WebServer::start(*runtime, web_options(options, plan)));
  }
  runtime->begin();
  for (const std::string& notice : wanted.notices) {
    spdlog::warn("{}", notice);
  }
  spdlog::info("listening on {}:{}, state in {}", options.listen.substr(0, options.listen.rfind(':')), api->port(),
               state->place);
  LM_RETURN_IF_ERROR(write_port(options.port_file, api->port()));
  if (web != nullptr) {
    spdlog::info("the page is at {}://{}:{}/", options.tls.given() ? "https" : "http",
                 shown_host(options.http.substr(0, options.http.rfind(':')), options.tls.certificate), web->port());
  }
  LM_RETURN_IF_ERROR(write_port(options.http_port_file, web == nullptr ? 0 : web->port()));
  HostMonitor monitor(options.tls, state->data ? state->data->path() : fs::path(), bytes_of_gib(options.reserve_gib),
                      [&runtime](const std::string& why) { runtime->loop().set_space(why); });
  auto next_collection = std::chrono::steady_clock::now() + kCollectionPause;
  do {
    monitor.check(system_clock().unix_milliseconds() / 1000);
    if (std::chrono::steady_clock::now() >= next_collection) {
      runtime->forget_unused_assets();
      next_collection = std::chrono::steady_clock::now() + kCollectionPause;
    }
  } while (stop.wait_for(kMonitorPause));
  Status failure = stop.wait();
  spdlog::info("stopping");
  web.reset();
  api.reset();
  const Status stopped = runtime->stop();
  return failure.ok() ? stopped : with_advice(failure);
}

int run(int argc, char** argv) {
  StopRequest stop;
  const StopSignals signals([&stop](int count) {
    if (count > 1) {
      std::_Exit(130);
    }
    stop.ask();
  });
  ServerOptions options;
  if (const std::optional<int> code = parse_server_options(argc, argv, options)) {
    return *code;
  }
  if (const Status status = start_logging("lightmill-server", options.log.level, options.log.format); !status.ok()) {
    std::cerr << "lightmill-server: " << message_of(status) << "\n";
    return 2;
  }
  const Status status = options.check ? check_stored(options, stop) : serve(options, stop);
  if (!status.ok()) {
    spdlog::error("{}", message_of(status));
    return 1;
  }
  if (!options.check) {
    spdlog::info("stopped");
  }
  return 0;
}

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  ::umask(0077);  // pictures, assets and hashes of tokens are only for callers that the coordinator admits
  lightmill::exit_on_out_of_memory("lightmill-server", 1);
  return lightmill::run(argc, argv);
}

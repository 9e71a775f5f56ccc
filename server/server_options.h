// Command-line options of lightmill-server.
#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/base/machine_memory.h"
#include "common/command_line/daemon_options.h"
#include "common/security/tls_files.h"
#include "server/access/call_limits.h"

namespace lightmill {

inline constexpr double kMinWireGib = 0.0625;  ///< room for a few messages

struct ServerOptions {
  std::string data;
  std::string store;  ///< empty: SQLite in the data folder
  bool accept_loss = false;
  std::string listen = "127.0.0.1:7350";
  std::string port_file;
  std::string http, http_port_file;  ///< empty: no page
  std::vector<std::string> http_names;
  std::string health, health_port_file;  ///< empty: health checks only on the gRPC port
  std::string pages;
  TlsFiles tls;
  bool insecure = false, authenticate = false;
  LogOptions log;
  double lease_seconds = 20;
  double heartbeat_seconds = 2;
  double return_seconds = 2;
  double unit_seconds = 1, tile_cpu_seconds = 600, results_mib = 192;
  double job_film_gib = share_of_memory_gib(1.0 / 16, 1);
  double all_films_gib = share_of_memory_gib(0.5, 65536);
  double max_assets_gib = 64;
  double max_asset_gib = 2;
  double user_disk_gib = 0;  ///< 0: the default
  std::uint32_t max_jobs = 10'000, user_jobs = 2'000;
  std::int32_t user_priority = 10;
  CallLimitOptions calls;
  double wire_gib = std::max(share_of_memory_gib(1.0 / 8, 4), kMinWireGib);
  std::uint32_t max_workers = 10'000;
  double http_seconds = 30;
  double keep_days = 90, reserve_gib = 0.25;
  std::uint32_t log_entries = 50'000;
  std::uint32_t log_days = 400;
  bool check = false;  ///< check the stored data instead of serving
};

/// Parses and checks the options. Returns an exit code if the program has nothing more to do: help was printed, or an
/// option is wrong, which is reported.
std::optional<int> parse_server_options(int argc, char** argv, ServerOptions& options);

}  // namespace lightmill

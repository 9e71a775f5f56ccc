// The choice of the farm that a command talks to.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <string>

#include "client/cli/console.h"
#include "client/cli/context.h"
#include "client/cli/coordinator_client.h"
#include "client/cli/local_farm.h"
#include "client/cli/signals.h"

namespace lightmill::cli {

inline constexpr const char* kDefaultServer = "127.0.0.1:7350";

/// A connection, and the local farm behind it if there is one.
struct Farm {
  std::unique_ptr<LocalFarm> local_farm;  ///< outlives the connection
  std::unique_ptr<CoordinatorClient> connection;
};

/// A note that the farm in use is not the one that quickstart.sh runs in `folder` or above it. Empty if no such farm of
/// this user runs there, or if it is at `address`. `used`: the farm in use, in words.
std::string other_farm_note(const std::filesystem::path& folder, const std::string& address, const std::string& used);

/// Connects to the farm of --server, else of LIGHTMILL_SERVER, else the default. Sends nothing yet. An error names a
/// malformed address, or what is wrong with a file of --tls-…. Nobody chose the default, so the console says if the
/// current folder has another farm.
Result<std::unique_ptr<CoordinatorClient>> connect(const CommonOptions& options, const Console& console);

/// Connects as above, runs `action` and reports its error.
ExitCode with_farm(const Console& console, const CommonOptions& options,
                   const std::function<Status(CoordinatorClient&)>& action);

/// The commands that start a first worker, as the end of a sentence.
std::string how_to_start_a_worker(const std::string& address, const CommonOptions& options);

/// Has the command call `action` with the farm, unless one of its subcommands was given.
void ask_farm(CLI::App& command, Context& context, std::function<Status(CoordinatorClient&, const Console&)> action);

/// Adds --local and --threads, for commands that may start a farm of their own.
void add_local_farm_options(CLI::App& command, bool& local, unsigned& threads);

/// The farm for `render`. This is the given farm; else one that answers on the default port, unless `local`; else a
/// local one with `local_options`. The console says which. INVALID_ARGUMENT if a farm is named together with
/// `local` or a number of threads.
Result<Farm> choose_farm(const CommonOptions& options, bool local, const LocalFarmOptions& local_options,
                         Signals& signals, const Console& console);

}  // namespace lightmill::cli

// Which farm a command talks to.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "client/cli/console.h"
#include "client/cli/context.h"
#include "client/cli/farm_connection.h"
#include "client/cli/private_farm.h"
#include "client/cli/signals.h"

namespace lightmill::cli {

inline constexpr const char* kDefaultServer = "127.0.0.1:7350";

/// A connection, and the private farm behind it if there is one.
struct Farm {
  std::unique_ptr<PrivateFarm> private_farm;  ///< outlives the connection
  std::unique_ptr<FarmConnection> connection;
};

/// The farm given by --server, else by LIGHTMILL_SERVER, else the default. Not contacted yet. Errors name a malformed
/// address, or what is wrong with a file of --tls-….
Result<std::unique_ptr<FarmConnection>> connect(const CommonOptions& options);

/// Connects as above and runs `action`; reports its error.
ExitCode with_farm(const Console& console, const CommonOptions& options,
                   const std::function<Status(FarmConnection&)>& action);

/// For `render`: the given farm; else one that answers on the default port, unless `local`; else a private one with
/// `private_options`. Says which on the console. INVALID_ARGUMENT where the farm that is named cannot be `local` or
/// have such threads.
Result<Farm> choose_farm(const CommonOptions& options, bool local, const PrivateFarmOptions& private_options,
                         Signals& signals, const Console& console);

}  // namespace lightmill::cli

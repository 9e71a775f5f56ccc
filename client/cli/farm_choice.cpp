#include "client/cli/farm_choice.h"

#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdlib>

#include "client/cli/units.h"
#include "common/base/file.h"
#include "common/base/text.h"

namespace lightmill::cli {
namespace fs = std::filesystem;
namespace {

constexpr Duration kGivenTimeout = std::chrono::seconds(10);
constexpr Duration kDefaultTimeout =
    std::chrono::milliseconds(700);  // the user did not ask for this farm, so the wait is short

/// The address that the user gave, and its option or variable. Empty if there is none.
struct GivenAddress {
  std::string address;
  const char* where = "";
};

GivenAddress given_address(const std::string& server_option) {
  if (!server_option.empty()) {
    return {server_option, "--server"};
  }
  const char* environment = std::getenv("LIGHTMILL_SERVER");
  return {environment == nullptr ? "" : environment, "LIGHTMILL_SERVER"};
}

Status check_one(const GivenAddress& given) {
  if (const std::size_t scheme = given.address.find("://"); scheme != std::string::npos) {
    return invalid_argument("{} is HOST:PORT of the coordinator's gRPC port: write {}, not {}", given.where,
                            given.address.substr(scheme + 3), given.address);
  }
  const std::size_t colon = given.address.rfind(':');
  if (colon != std::string::npos && given.address.find(':') != colon && given.address[colon - 1] != ']') {
    return invalid_argument("{}: an IPv6 address goes in brackets: write [{}]{}, not {}", given.where,
                            given.address.substr(0, colon), given.address.substr(colon), given.address);
  }
  if (colon != std::string::npos && colon > 0 &&
      parse_number<std::uint16_t>(std::string_view(given.address).substr(colon + 1)).value_or(0) > 0) {
    return ok_status();
  }
  return invalid_argument("{} must be HOST:PORT (as in farm.example:7350), got '{}'", given.where, given.address);
}

Status check_address(const GivenAddress& given) {
  for (std::size_t at = 0; at <= given.address.size();) {
    const std::size_t end = std::min(given.address.find(',', at), given.address.size());
    LM_RETURN_IF_ERROR(check_one({given.address.substr(at, end - at), given.where}));
    at = end + 1;
  }
  return ok_status();
}

/// The credentials that this caller shows the farm at `addresses`.
Result<CallerTexts> read_caller(const CommonOptions& options, const std::string& addresses) {
  return lightmill::read_caller(options.caller, CLI::detail::split(addresses, ','), now_unix_s());
}

/// The port of the farm that quickstart.sh has started in this folder, if it runs and belongs to this user.
std::optional<std::uint16_t> port_of_quickstart(const fs::path& folder) {
  constexpr std::uint64_t kMaxBytes = 100;
  const auto first_line = [&](const char* name) {
    const fs::path file = folder / ".lightmill" / "quickstart" / name;
    struct stat info {};
    const bool own = ::lstat(file.c_str(), &info) == 0 && S_ISREG(info.st_mode) && info.st_uid == ::geteuid();
    const std::string text = own ? read_file(file, kMaxBytes).value_or("") : "";
    return text.substr(0, text.find('\n'));
  };
  const pid_t server = parse_number<pid_t>(first_line("server.pid")).value_or(0);
  return server > 0 && ::kill(server, 0) == 0 ? parse_number<std::uint16_t>(first_line("port")) : std::nullopt;
}

}  // namespace

std::string other_farm_note(const fs::path& folder, const std::string& address, const std::string& used) {
  fs::path place = folder;
  std::optional<std::uint16_t> port = port_of_quickstart(place);
  while (!port && place.has_relative_path()) {
    place = place.parent_path();
    port = port_of_quickstart(place);
  }
  const std::string there = fmt::format("127.0.0.1:{}", port.value_or(0));
  return !port || there == address ? ""
                                   : fmt::format(
                                         "note: this command uses {}. The farm of {} is at {}: give --server {} to use "
                                         "it",
                                         used, (place / "quickstart.sh").string(), there, there);
}

namespace {

/// `used`: the farm that the command uses, in words.
void warn_of_other_farm(const Console& console, const std::string& used) {
  std::error_code error;
  const fs::path here = fs::current_path(error);
  if (const std::string note = error ? "" : other_farm_note(here, kDefaultServer, used); !note.empty()) {
    console.notice(note);
  }
}

}  // namespace

Result<std::unique_ptr<CoordinatorClient>> connect(const CommonOptions& options, const Console& console) {
  GivenAddress given = given_address(options.server);
  if (given.address.empty()) {
    given.address = kDefaultServer;
    warn_of_other_farm(console, fmt::format("the farm at {}", kDefaultServer));
  }
  LM_RETURN_IF_ERROR(check_address(given));
  LM_ASSIGN_OR_RETURN(CallerTexts caller, read_caller(options, given.address));
  return std::make_unique<CoordinatorClient>(given.address, std::move(caller));
}

ExitCode with_farm(const Console& console, const CommonOptions& options,
                   const std::function<Status(CoordinatorClient&)>& action) {
  const Result<std::unique_ptr<CoordinatorClient>> connection = connect(options, console);
  const Status status = connection.ok() ? action(**connection) : connection.status();
  return status.ok() ? kDone : console.fail(status);
}

std::string how_to_start_a_worker(const std::string& address, const CommonOptions& options) {
  const std::string& authority = options.caller.tls.authority;
  return authority.empty()
             ? fmt::format("start one with `lightmill-worker --server {}`", address)
             : fmt::format(
                   "make a token with `lightmill tokens create render --enrol 1 --out render.enrol{}`, and start "
                   "one with `lightmill-worker --server {} --tls-ca {} --enrol-file render.enrol`",
                   options.farm_options(), address, authority);
}

void ask_farm(CLI::App& command, Context& context, std::function<Status(CoordinatorClient&, const Console&)> action) {
  command.callback([&command, &context, action = std::move(action)] {
    if (!command.get_subcommands().empty()) {
      return;  // the subcommand's callback has run
    }
    context.run = [&context, action](const Console& console) {
      return with_farm(console, context.common,
                       [&](CoordinatorClient& connection) { return action(connection, console); });
    };
  });
}

void add_local_farm_options(CLI::App& command, bool& local, unsigned& threads) {
  command.add_flag("--local", local, "use a local farm, even if another one answers");
  command.add_option("--threads", threads, "threads of a local farm (default: one per core)")
      ->type_name("N")
      ->check(whole_number(1, 4096));
}

Result<Farm> choose_farm(const CommonOptions& options, bool local, const LocalFarmOptions& local_options,
                         Signals& signals, const Console& console) {
  Farm farm;
  if (local && !options.server.empty()) {
    return invalid_argument("--local and --server exclude each other: give one");
  }
  const GivenAddress given = local ? GivenAddress{} : given_address(options.server);
  if (!given.address.empty()) {
    LM_RETURN_IF_ERROR(check_address(given));
    if (local_options.threads > 0) {
      return invalid_argument(
          "--threads applies only to a local farm, but {} names a farm: leave out --threads, or give --local instead",
          given.where);
    }
    LM_ASSIGN_OR_RETURN(CallerTexts caller, read_caller(options, given.address));
    farm.connection = std::make_unique<CoordinatorClient>(given.address, std::move(caller));
    LM_RETURN_IF_ERROR(farm.connection->probe(kGivenTimeout));
    console.notice(fmt::format("farm: {} (given by {})", given.address, given.where));
    return farm;
  }
  if (!local) {
    LM_ASSIGN_OR_RETURN(CallerTexts caller, read_caller(options, kDefaultServer));
    farm.connection = std::make_unique<CoordinatorClient>(kDefaultServer, std::move(caller));
    if (farm.connection->probe(kDefaultTimeout).ok()) {
      console.notice(fmt::format(
          "farm: {} (it answers on the default port{})", kDefaultServer,
          local_options.threads > 0 ? "; --threads has no effect, because it applies only to a local farm" : ""));
      warn_of_other_farm(console, fmt::format("the farm at {}", kDefaultServer));
      return farm;
    }
  }
  LM_ASSIGN_OR_RETURN(farm.local_farm, LocalFarm::start(signals, local_options));
  farm.connection = std::make_unique<CoordinatorClient>(farm.local_farm->address());
  console.notice(fmt::format("farm: a local one for this command ({})",
                             local ? "--local" : fmt::format("no farm answers at {}", kDefaultServer)));
  if (!local) {
    warn_of_other_farm(console, "a local farm");
  }
  return farm;
}

}  // namespace lightmill::cli

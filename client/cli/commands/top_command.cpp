// lightmill top
#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "client/cli/context.h"
#include "client/cli/farm_choice.h"
#include "client/cli/job_json.h"
#include "client/cli/progress.h"
#include "client/cli/text_width.h"
#include "client/cli/top_view.h"
#include "client/cli/units.h"
#include "common/base/text.h"

namespace lightmill::cli {
namespace {

constexpr std::size_t kMostJobs = 1'000;
constexpr auto kLookForKeys = std::chrono::milliseconds(100);

constexpr const char* kMore =
    "It looks at the thousand newest jobs, and shows those that have not ended. q or Ctrl-C leaves; where standard "
    "output\n"
    "is no terminal, and with --json, it looks once.";

struct Options {
  bool once = false;
  std::string interval = "2s";
};

Result<FarmLook> look_at(FarmConnection& connection) {
  LM_ASSIGN_OR_RETURN(Listed<v1::Job> jobs, connection.list_jobs(kMostJobs));
  LM_ASSIGN_OR_RETURN(ListedWorkers workers, connection.list_workers());
  return FarmLook{connection.address(), std::move(jobs.items), std::move(workers.items), workers.wanted,
                  std::move(workers.notices)};
}

nlohmann::json to_json(const FarmLook& look) {
  nlohmann::json jobs = nlohmann::json::array(), workers = nlohmann::json::array();
  for (const v1::Job& job : look.jobs) {
    if (!has_ended(job.state())) {
      jobs.push_back(cli::to_json(job));
    }
  }
  for (const v1::Worker& worker : look.workers) {
    workers.push_back(cli::to_json(worker));
  }
  return {{"jobs", jobs}, {"workers", workers}, {"wanted_workers", look.wanted}, {"notices", look.notices}};
}

/// A terminal's second screen, without a cursor, and keys that are read as they are pressed. Ends as it began.
class Screen {
 public:
  Screen() {
    keys_ = ::isatty(STDIN_FILENO) == 1 && ::tcgetattr(STDIN_FILENO, &before_) == 0;
    if (keys_) {
      termios now = before_;
      now.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
      ::tcsetattr(STDIN_FILENO, TCSANOW, &now);
    }
    put("\x1b[?1049h\x1b[?25l");
  }
  ~Screen() {
    put("\x1b[?25h\x1b[?1049l");
    if (keys_) {
      ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
    }
  }
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// Columns and rows.
  static std::pair<int, int> size() {
    winsize size{};
    const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0;
    return known ? std::pair<int, int>(size.ws_col, size.ws_row) : std::pair(80, 24);
  }
  static void show(const std::vector<std::string>& lines) {
    std::string text = "\x1b[H";
    for (std::size_t i = 0; i < lines.size(); ++i) {
      text += lines[i] + "\x1b[K" + (i + 1 < lines.size() ? "\r\n" : "");
    }
    put(text + "\x1b[J");
  }
  /// Waits, at most so long; whether somebody wants to leave.
  bool wait(Signals& signals, double seconds) const {
    const auto until = std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds);
    while (!signals.interrupted() && std::chrono::steady_clock::now() < until) {
      if (!keys_) {
        signals.sleep(kLookForKeys);
        continue;
      }
      pollfd input{STDIN_FILENO, POLLIN, 0};
      if (::poll(&input, 1, static_cast<int>(kLookForKeys.count())) > 0) {
        char key = 0;
        if (::read(STDIN_FILENO, &key, 1) != 1 || key == 'q' || key == 'Q') {
          return true;
        }
      }
    }
    return signals.interrupted();
  }

 private:
  static void put(const std::string& text) {
    std::fwrite(text.data(), 1, text.size(), stdout);
    std::fflush(stdout);
  }
  bool keys_ = false;
  termios before_{};
};

ExitCode top(Context& context, const Console& console, const Options& options) {
  const Result<std::unique_ptr<FarmConnection>> connection = connect(context.common);
  if (!connection.ok()) {
    return console.fail(connection.status());
  }
  Result<FarmLook> look = look_at(**connection);
  if (!look.ok()) {
    return console.fail(look.status());
  }
  if (options.once || console.json() || ::isatty(STDOUT_FILENO) != 1) {
    console.object(to_json(*look));
    for (const std::string& line : top_lines(*look, 0, 0)) {
      console.result(line);
    }
    return kDone;
  }
  const double interval = *parse_seconds(options.interval);
  const Screen screen;
  FarmLook last = *look;
  do {
    const auto [columns, rows] = Screen::size();
    if (look.ok()) {
      last = *look;
    }
    std::vector<std::string> lines = top_lines(last, columns, look.ok() ? rows : rows - 1);
    if (!look.ok()) {
      lines.insert(lines.begin(), cut_to_columns("as it was; now: " + printable(message_of(look.status())), columns));
    }
    Screen::show(lines);
    if (screen.wait(context.signals, interval)) {
      return kDone;
    }
    look = look_at(**connection);
  } while (!context.signals.interrupted());
  return kDone;
}

}  // namespace

void add_top_command(CLI::App& app, Context& context) {
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("top", "Watch the farm: its jobs that have not ended, and its workers.");
  command->footer(kMore);
  command->add_flag("--once", options->once, "look once");
  command->add_option("--interval", options->interval, "between two looks, as 0.5s or 1m")
      ->type_name("TIME")
      ->check(readable(parse_seconds))
      ->capture_default_str();
  add_common_options(*command, context);
  command->callback([&context, options] {
    context.run = [&context, options](const Console& console) { return top(context, console, *options); };
  });
}

}  // namespace lightmill::cli

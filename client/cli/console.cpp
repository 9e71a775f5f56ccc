#include "client/cli/console.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace lightmill::cli {
namespace {

constexpr int kDefaultColumns = 80;

void write_line(std::FILE* stream, std::string_view line) {
  std::fwrite(line.data(), 1, line.size(), stream);
  std::fputc('\n', stream);
  std::fflush(stream);
}

}  // namespace

ExitCode exit_code_of(const Status& status) {
  switch (status.code()) {
    case StatusCode::kOk:
      return kDone;
    case StatusCode::kUnavailable:
    case StatusCode::kDeadlineExceeded:
      return kUnreachable;
    case StatusCode::kCancelled:
      return kInterrupted;
    case StatusCode::kInvalidArgument:
    case StatusCode::kNotFound:
    case StatusCode::kAlreadyExists:
    case StatusCode::kFailedPrecondition:
    case StatusCode::kOutOfRange:
    case StatusCode::kPermissionDenied:
      return kBadInput;
    default:
      return kJobFailed;
  }
}

Console::Console(bool json) : json_(json) {
  const char* term = std::getenv("TERM");
  terminal_ = !json && ::isatty(STDERR_FILENO) == 1 && term != nullptr && std::string_view(term) != "dumb";
  const char* no_color = std::getenv("NO_COLOR");
  color_ = terminal_ && (no_color == nullptr || *no_color == '\0');
}

int Console::width() const {
  winsize size{};
  if (::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0) {
    return size.ws_col;
  }
  return kDefaultColumns;
}

void Console::result(std::string_view line) const {
  if (!json_) {
    end_redraw();
    write_line(stdout, line);
  }
}

void Console::object(const nlohmann::json& object) const {
  if (json_) {
    // Names of files need not be UTF-8.
    write_line(stdout, object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
}

void Console::notice(std::string_view line) const {
  if (!json_) {
    end_redraw();
    write_line(stderr, line);
  }
}

ExitCode Console::fail(const Status& status) const {
  const ExitCode code = exit_code_of(status);
  end_redraw();
  if (json_) {
    write_line(stdout, nlohmann::json{{"error", message_of(status)}, {"exit_code", static_cast<int>(code)}}.dump(
                           -1, ' ', false, nlohmann::json::error_handler_t::replace));
  }
  write_line(stderr,
             fmt::format("{}lightmill: {}{}", color_ ? "\x1b[31m" : "", message_of(status), color_ ? "\x1b[0m" : ""));
  return code;
}

void Console::redraw(std::string_view line) const {
  const std::string text = fmt::format("\r{}\x1b[K", line);
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
  redrawn_ = true;
}

void Console::end_redraw() const {
  if (redrawn_) {
    std::fputc('\n', stderr);
    std::fflush(stderr);
    redrawn_ = false;
  }
}

}  // namespace lightmill::cli

#include "client/cli/console.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>

#include "common/base/openjd.h"
#include "common/base/text.h"
#include "common/base/text_width.h"
#include "common/command_line/usage_errors.h"

namespace lightmill::cli {
namespace {

constexpr int kDefaultColumns = 80;

/// The text, wrapped to the stream's columns. Unchanged without a limit.
std::string wrapped(std::FILE* stream, std::string_view text) {
  return wrap_lines(text, output_columns(::fileno(stream)));
}

/// Returns 0 or the errno of the failed call.
int write_text(std::FILE* stream, std::string_view text) {
  return std::fwrite(text.data(), 1, text.size(), stream) == text.size() && std::fflush(stream) == 0 ? 0 : errno;
}

int write_line(std::FILE* stream, std::string_view line) {
  return write_text(stream, fmt::format("{}\n", line));
}

/// File names may not be UTF-8.
std::string text_of(const nlohmann::json& object) {
  return object.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace

ExitCode exit_code_of(const Status& status) {
  switch (status.code()) {
    case StatusCode::kOk:
      return kDone;
    case StatusCode::kUnavailable:
    case StatusCode::kDeadlineExceeded:
    case StatusCode::kResourceExhausted:
      return kUnreachable;
    case StatusCode::kCancelled:
      return kInterrupted;
    case StatusCode::kInvalidArgument:
    case StatusCode::kNotFound:
    case StatusCode::kAlreadyExists:
    case StatusCode::kFailedPrecondition:
    case StatusCode::kOutOfRange:
    case StatusCode::kPermissionDenied:
    case StatusCode::kUnauthenticated:
      return kBadInput;
    default:
      return kJobFailed;
  }
}

Status as_input_error(const Status& status) {
  return status.code() == StatusCode::kResourceExhausted ? invalid_argument("{}", message_of(status)) : status;
}

Status as_output_error(const Status& status) {
  return status.ok() ? status : make_error(StatusCode::kAborted, "{}", message_of(status));
}

Console::Console(bool json, bool openjd) : json_(json), openjd_(openjd) {
  terminal_ = !json && can_redraw(STDERR_FILENO);
  color_ = terminal_ && colors_wanted();
}

int Console::width() const {
  const int terminal = terminal_columns(STDERR_FILENO), columns = output_columns(STDERR_FILENO);
  // A redrawn line that is wider than the terminal would leave a copy behind at each change.
  return terminal > 0 ? std::min(terminal, columns) : columns > 0 ? columns : kDefaultColumns;
}

void Console::result(std::string_view line) const {
  styled_result(wrapped(stdout, printable(line, true)));
}

void Console::styled_result(std::string_view line) const {
  if (!json_) {
    const MutexLock lock(mutex_);
    end_redrawn();
    write_result(line);
  }
}

void Console::text(std::string_view text) const {
  const MutexLock lock(mutex_);
  note_write(write_text(stdout, text));
}

void Console::object(const nlohmann::json& object) const {
  if (json_) {
    const MutexLock lock(mutex_);
    write_result(text_of(object));
  }
}

void Console::notice(std::string_view line) const {
  const MutexLock lock(mutex_);
  if (redrawn_) {  // the line is drawn again below the notice
    std::fputs("\r\x1b[K", stderr);
    redrawn_.reset();
  }
  write_line(stderr, wrapped(stderr, printable(line, true)));
}

void Console::notices(std::span<const std::string> lines) const {
  for (const std::string& line : lines) {
    notice(line);
  }
}

void Console::progress(std::string_view line) const {
  if (!json_) {
    notice(line);
  }
}

void Console::notify_manager(double fraction, std::string_view status) const {
  if (openjd_) {
    const MutexLock lock(mutex_);
    end_redrawn();
    write_result(openjd_progress(fraction));
    write_result(openjd_status(status));
  }
}

ExitCode Console::fail(const Status& status) const {
  return fail(status, nlohmann::json::object());
}

ExitCode Console::fail(const Status& status, nlohmann::json object) const {
  const ExitCode code = exit_code_of(status);
  const MutexLock lock(mutex_);
  end_redrawn();
  if (json_) {
    object["failure"] = {{"message", message_of(status)}, {"exit_code", static_cast<int>(code)}};
    write_result(text_of(object));
  }
  if (openjd_) {
    write_result(openjd_fail(message_of(status)));
  }
  write_line(stderr, error_for_terminal("lightmill: " + printable(message_of(status), true)));
  return code;
}

void Console::write_result(std::string_view line) const {
  note_write(write_line(stdout, line));
}

void Console::note_write(int error) const {
  write_error_ = write_error_ == 0 ? error : write_error_;
}

ExitCode Console::finish(ExitCode code) const {
  const MutexLock lock(mutex_);
  if (write_error_ == 0 || write_error_ == EPIPE) {
    return code;
  }
  write_line(stderr, fmt::format("lightmill: cannot write to standard output: {}", std::strerror(write_error_)));
  return code == kDone ? kJobFailed : code;
}

void Console::redraw(std::string_view line) const {
  std::string text = fmt::format("\r{}\x1b[K", line);
  const MutexLock lock(mutex_);
  std::fwrite(text.data(), 1, text.size(), stderr);
  std::fflush(stderr);
  redrawn_ = std::move(text);
}

void Console::end_redraw() const {
  const MutexLock lock(mutex_);
  end_redrawn();
}

void Console::end_redrawn() const {
  if (redrawn_) {
    write_line(stderr, *redrawn_);
    redrawn_.reset();
  }
}

}  // namespace lightmill::cli

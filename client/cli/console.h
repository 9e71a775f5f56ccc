// The client's output: results on standard output; progress, notices and errors on standard error.
//
// With --json a command prints exactly one JSON object on standard output, and no progress. An error is its "failure":
// {"message", "exit_code"}. Control characters from outside are escaped.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "common/base/mutex.h"
#include "common/base/status.h"

namespace lightmill::cli {

/// Exit codes of every command. kUnreachable also means a farm that is full or too busy now. The same command may
/// succeed later.
enum ExitCode : int { kDone = 0, kJobFailed = 1, kBadInput = 2, kUnreachable = 3, kInterrupted = 130 };

/// The exit code for an error.
ExitCode exit_code_of(const Status& status);

/// An error of reading input. Input that is too large for this program is bad input, not a farm that is full.
Status as_input_error(const Status& status);

/// An error of writing a result, after the place for it was found to be writable. The exit code is always kJobFailed.
Status as_output_error(const Status& status);

/// Thread-safe. Each line is written whole, and never inside a redrawn line.
class Console {
 public:
  /// `openjd`: progress and errors also go to standard output, for a farm manager that runs this as a task.
  explicit Console(bool json, bool openjd = false);

  bool json() const { return json_; }
  bool openjd() const { return openjd_; }
  bool terminal() const { return terminal_; }  ///< whether standard error is a terminal, so that lines can be redrawn
  bool color() const { return color_; }        ///< whether it is a terminal, and NO_COLOR is not set
  int width() const;                           ///< columns of redrawn lines

  void result(std::string_view line) const;                ///< a line for people; nothing with --json
  void styled_result(std::string_view line) const;         ///< the same, with control characters for the terminal
  void text(std::string_view text) const;                  ///< as it is, for people and programs
  void object(const nlohmann::json& object) const;         ///< the object of --json; nothing without --json
  void notice(std::string_view line) const;                ///< a line on standard error
  void notices(std::span<const std::string> lines) const;  ///< one each
  void progress(std::string_view line) const;              ///< how far the work is; nothing with --json
  /// Progress for a farm manager: the fraction done, and a text. Nothing without --openjd.
  void notify_manager(double fraction, std::string_view status) const;
  /// Reports an error, with --json also as an object. Returns its exit code.
  ExitCode fail(const Status& status) const;
  /// The same. Adds "failure" to `object`.
  ExitCode fail(const Status& status, nlohmann::json object) const;
  /// The exit code of the process: `code`, or kJobFailed if results could not be written. A reader that closed its pipe
  /// is no error.
  ExitCode finish(ExitCode code) const;

  /// Replaces the last redrawn line (terminals only).
  void redraw(std::string_view line) const;
  /// Ends a redrawn line, so that output continues on a new one. The line stays, without a ^C that the terminal echoed.
  void end_redraw() const;

 private:
  void end_redrawn() const LM_REQUIRES(mutex_);
  void write_result(std::string_view line) const LM_REQUIRES(mutex_);
  void note_write(int error) const LM_REQUIRES(mutex_);

  bool json_ = false, openjd_ = false;
  bool terminal_ = false;
  bool color_ = false;
  mutable Mutex mutex_;  ///< held while a line is written, so that lines do not mix
  mutable std::optional<std::string> redrawn_ LM_GUARDED_BY(mutex_);  ///< the line on the screen
  /// errno of the first failed write to standard output
  mutable int write_error_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill::cli

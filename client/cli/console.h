// What the client says: results on standard output, everything else (progress, notices, errors) on standard error.
//
// With --json standard output carries exactly one JSON object per command; progress is left out. An error is its
// "failure": {"message", "exit_code"}. Control characters from elsewhere are escaped on the way out.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <string_view>

#include "common/base/mutex.h"
#include "common/base/status.h"

namespace lightmill::cli {

/// Exit codes of every command.
/// kUnreachable also stands for a farm that is full or too busy now: the same command may do later.
enum ExitCode : int { kDone = 0, kJobFailed = 1, kBadInput = 2, kUnreachable = 3, kInterrupted = 130 };

/// The exit code that fits an error.
ExitCode exit_code_of(const Status& status);

/// An error of reading input: what is too large for this program is bad input, not a farm that is full.
Status as_input_error(const Status& status);

/// An error of writing a picture that was rendered: whatever the reason, the exit code is kJobFailed.
Status as_output_error(const Status& status);

/// Thread-safe: each line is whole, and never in the midst of a redrawn one.
class Console {
 public:
  /// `openjd`: progress and errors are told on standard output too, for a farm manager that runs this as a task.
  explicit Console(bool json, bool openjd = false);

  bool json() const { return json_; }
  bool openjd() const { return openjd_; }
  bool terminal() const { return terminal_; }  ///< whether standard error is one, so that lines can be redrawn
  bool color() const { return color_; }        ///< a terminal, and NO_COLOR is not set
  int width() const;                           ///< columns now

  void result(std::string_view line) const;                ///< a line of human output; nothing with --json
  void styled_result(std::string_view line) const;         ///< the same; its control characters are the terminal's
  void object(const nlohmann::json& object) const;         ///< the one object of --json; nothing without
  void notice(std::string_view line) const;                ///< a line of news
  void notices(std::span<const std::string> lines) const;  ///< one each
  void progress(std::string_view line) const;              ///< how far work is; nothing with --json
  /// The same for a farm manager: the part that is done, and more in words. Nothing without --openjd.
  void tell_manager(double fraction, std::string_view status) const;
  /// Reports an error (as an object too with --json) and gives the exit code that fits it.
  ExitCode fail(const Status& status) const;
  /// The same with more to say in the object: "failure" is added to it.
  ExitCode fail(const Status& status, nlohmann::json object) const;
  /// The exit code at the end: `code`, but kJobFailed if results did not reach standard output. A reader that has
  /// closed its pipe has seen what it wanted.
  ExitCode finish(ExitCode code) const;

  /// Puts `line` in place of the last redrawn one (terminals only).
  void redraw(std::string_view line) const;
  /// Ends a redrawn line, so that what follows starts on a new one.
  void end_redraw() const;

 private:
  void end_redrawn() const LM_REQUIRES(mutex_);
  void write_result(std::string_view line) const LM_REQUIRES(mutex_);

  bool json_ = false, openjd_ = false;
  bool terminal_ = false;
  bool color_ = false;
  mutable Mutex mutex_;  ///< held while a line is written, as it is there to keep lines apart
  mutable bool redrawn_ LM_GUARDED_BY(mutex_) = false;
  /// errno of the first result that did not reach standard output
  mutable int write_error_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill::cli

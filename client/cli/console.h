// What the client says: results on standard output, everything else (progress, notices, errors) on standard error.
//
// With --json standard output carries exactly one JSON object per command, and notices are left out.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace lightmill::cli {

/// Exit codes of every command.
enum ExitCode : int { kDone = 0, kJobFailed = 1, kBadInput = 2, kUnreachable = 3, kInterrupted = 130 };

/// The exit code that fits an error.
ExitCode exit_code_of(const Status& status);

class Console {
 public:
  explicit Console(bool json);

  bool json() const { return json_; }
  bool terminal() const { return terminal_; }  ///< whether standard error is one, so that lines can be redrawn
  bool color() const { return color_; }        ///< a terminal, and NO_COLOR is not set
  int width() const;                           ///< columns now

  void result(std::string_view line) const;         ///< a line of human output; nothing with --json
  void object(const nlohmann::json& object) const;  ///< the one object of --json; nothing without
  void notice(std::string_view line) const;         ///< a line of news; nothing with --json
  /// Reports an error (as an object too with --json) and gives the exit code that fits it.
  ExitCode fail(const Status& status) const;

  /// Puts `line` in place of the last redrawn one (terminals only).
  void redraw(std::string_view line) const;
  /// Ends a redrawn line, so that what follows starts on a new one.
  void end_redraw() const;

 private:
  bool json_ = false;
  bool terminal_ = false;
  bool color_ = false;
  mutable bool redrawn_ = false;
};

}  // namespace lightmill::cli

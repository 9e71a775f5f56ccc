// A terminal's second screen, and its keys as they are pressed.
#pragma once

#include <termios.h>

#include <mutex>
#include <string>
#include <vector>

#include "client/cli/signals.h"

namespace lightmill::cli {

/// While it lives, standard output's terminal shows its second screen, without a cursor and without breaking lines, and
/// what is typed is not shown. Ends with the terminal as it was, also where a second Ctrl-C ends the process. Ctrl-Z
/// and Ctrl-\ do nothing meanwhile: they would leave the terminal as it is.
class Screen {
 public:
  struct Size {
    int columns = 80, rows = 24;
    friend bool operator==(const Size&, const Size&) = default;
  };

  explicit Screen(Signals& signals);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  /// As it is now.
  static Size size();
  /// In place of what it shows; no more and no wider than its size.
  static void show(const std::vector<std::string>& lines);
  /// Waits, at most so long, for a key or a signal; whether it asks to leave: q, Ctrl-C.
  bool asked_to_leave(Duration patience) const;

 private:
  void restore();

  Signals& signals_;
  bool keys_ = false;  ///< whether standard input is a terminal
  termios before_{};
  std::once_flag restored_;
};

}  // namespace lightmill::cli

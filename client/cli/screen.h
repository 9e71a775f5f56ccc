// The terminal's alternate screen, and single key presses.
#pragma once

#include <termios.h>

#include <mutex>
#include <string>
#include <vector>

#include "client/cli/signals.h"

namespace lightmill::cli {

/// The alternate screen of standard output's terminal, without cursor, line wrapping and echo. The destructor restores
/// the terminal. So does a second Ctrl-C, which ends the process. Ctrl-Z and Ctrl-\ are ignored, because they would
/// leave the terminal unrestored.
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

  /// The current size.
  static Size size();
  /// Replaces the screen's content. `lines` must fit its size.
  static void show(const std::vector<std::string>& lines);
  /// Waits for a key or a signal, at most `timeout`. Returns whether it asks to leave: q or Ctrl-C.
  bool quit_requested(Duration timeout) const;

 private:
  void restore();

  Signals& signals_;
  bool keys_ = false;  ///< whether standard input is a terminal
  termios before_{};
  std::once_flag restored_;
};

}  // namespace lightmill::cli

#include "client/cli/screen.h"

#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <string_view>

namespace lightmill::cli {
namespace {

/// Alternate screen on, cursor off, line wrapping off: DEC private modes 1049, 25 and 7 of xterm and compatible
/// terminals.
constexpr std::string_view kEnter = "\x1b[?1049h\x1b[?25l\x1b[?7l";
constexpr std::string_view kLeave = "\x1b[?7h\x1b[?25h\x1b[?1049l";

/// Not with stdio, because another thread may hold its lock.
void put(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(STDOUT_FILENO, text.data(), text.size());
    if (written < 0 && errno == EINTR) {
      continue;
    }
    if (written <= 0) {
      return;  // the terminal is gone
    }
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

}  // namespace

Screen::Screen(Signals& signals) : signals_(signals) {
  keys_ = ::isatty(STDIN_FILENO) == 1 && ::tcgetattr(STDIN_FILENO, &before_) == 0;
  signals_.before_exit([this] { restore(); });
  if (keys_) {
    termios now = before_;
    now.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    now.c_cc[VSUSP] = now.c_cc[VQUIT] = _POSIX_VDISABLE;
    ::tcsetattr(STDIN_FILENO, TCSANOW, &now);
  }
  put(kEnter);
}

Screen::~Screen() {
  restore();
  signals_.before_exit({});
}

void Screen::restore() {
  std::call_once(restored_, [this] {
    if (keys_) {
      ::tcsetattr(STDIN_FILENO, TCSANOW, &before_);
    }
    put(kLeave);
  });
}

Screen::Size Screen::size() {
  winsize size{};
  const bool known = ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 && size.ws_row > 0;
  return known ? Size{size.ws_col, size.ws_row} : Size{};
}

void Screen::show(const std::vector<std::string>& lines) {
  // Each line is cleared before its text. After a full line the cursor stands on the last character, and clearing to
  // the right would delete it.
  std::string text = "\x1b[H";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const bool last = i + 1 == lines.size();
    text += last ? "\x1b[J" + lines[i] : "\x1b[2K" + lines[i] + "\r\n";
  }
  put(text);
}

bool Screen::quit_requested(Duration timeout) const {
  if (!keys_) {
    signals_.sleep(timeout);
    return signals_.interrupted();
  }
  pollfd input{STDIN_FILENO, POLLIN, 0};
  const auto milliseconds = std::chrono::duration_cast<std::chrono::milliseconds>(timeout).count();
  char key = 0;
  if (::poll(&input, 1, static_cast<int>(milliseconds)) > 0 && ::read(STDIN_FILENO, &key, 1) != 1) {
    return true;  // the terminal is gone
  }
  return key == 'q' || key == 'Q' || signals_.interrupted();
}

}  // namespace lightmill::cli

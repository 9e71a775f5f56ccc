// Tools for operators: one unit in the logs of all programs, and `top` in a terminal.
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <utmp.h>

#include <cstring>
#include <fstream>
#include <regex>
#include <set>

#include "client/cli/async_call.h"
#include "client/cli/coordinator_client.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

std::vector<std::string> lines_with(const std::string& path, const std::string& text) {
  std::vector<std::string> lines;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.find(text) != std::string::npos) {
      lines.push_back(line);
    }
  }
  return lines;
}

TEST_F(FarmCliTest, AUnitIsFollowedFromItsLeaseToItsCommit) {
  stop_server();
  start_server("127.0.0.1:0", {"--log-level", "debug"});
  const CommandResult submitted =
      lightmill({"submit", scene("cornell-bench-blocks.json"), "--size", "96x80", "--spp", "8", "--server", server()});
  ASSERT_EQ(submitted.exit_code, 0) << submitted.err;
  EXPECT_EQ(submitted.err.find("trace"), std::string::npos) << submitted.err;
  const std::string trace = on_farm({"show", "1"})["trace_id"];
  EXPECT_EQ(lightmill({"show", "1", "--server", server()}).out.find(trace), std::string::npos);
  const CommandResult verbose = lightmill({"show", "1", "--verbose", "--server", server()});
  EXPECT_NE(verbose.out.find(trace), std::string::npos) << verbose.out;
  start_worker("w1", {"--log-level", "debug", "--log-format", "json"});
  ASSERT_EQ(on_farm({"watch", "1"})["state"], "done");

  const std::vector<std::string> granted = lines_with(file("server.log"), "is granted: job 1, ");
  ASSERT_FALSE(granted.empty());
  std::smatch ids;
  ASSERT_TRUE(std::regex_search(granted[0], ids,
                                std::regex("lease ([0-9]+) is granted.* trace_id=([0-9a-f]+) "
                                           "span_id=([0-9a-f]{16})$")))
      << granted[0];
  EXPECT_EQ(ids[2], trace);
  const std::string lease = ids[1], span = ids[3];
  EXPECT_EQ(std::stoull(span, nullptr, 16), std::stoull(lease));

  // The steps of each tile of the unit, in order. The two logs use the same clock.
  std::string tile;
  std::string last = granted[0].substr(0, 23);
  const auto expect_step = [&](const std::string& program, const std::string& what) {
    const bool worker = program == "w1";
    std::vector<std::string> steps =
        lines_with(file(program + ".log"), worker ? R"("span_id":")" + span : "span_id=" + span);
    std::erase_if(steps, [&](const std::string& line) {
      return line.find(what) == std::string::npos || line.find("tile " + tile) == std::string::npos;
    });
    ASSERT_EQ(steps.size(), 1u) << program << ": " << what;
    std::string time = steps[0].substr(0, 23);
    if (worker) {
      const nlohmann::json line = nlohmann::json::parse(steps[0], nullptr, false);
      ASSERT_FALSE(line.is_discarded()) << steps[0];
      EXPECT_EQ(line["trace_id"], trace);
      EXPECT_EQ(line["span_id"], span);
      time = line["time"].get<std::string>().substr(0, 23);
      time[10] = ' ';
    } else {
      EXPECT_NE(steps[0].find("trace_id=" + trace), std::string::npos);
    }
    EXPECT_LE(last, time) << program << ": " << what;
    last = time;
  };
  const std::vector<std::string> here = lines_with(file("server.log"), "lease " + lease + ": ");
  ASSERT_FALSE(here.empty());
  std::smatch number;
  ASSERT_TRUE(std::regex_search(here[0], number, std::regex("tile ([0-9]+) is here"))) << here[0];
  tile = number[1];
  expect_step("w1", "is to be rendered");
  expect_step("w1", "and sent");
  expect_step("server", "is here");
  expect_step("server", "is committed");
  expect_step("w1", "is stored by the coordinator");
  EXPECT_EQ(lines_with(file("server.log"), "submitted by").at(0).find("trace_id=" + trace) == std::string::npos, false);
}

/// A program in its own terminal.
class Terminal {
 public:
  Terminal(const std::vector<std::string>& command, unsigned short rows, unsigned short columns) {
    const winsize size{rows, columns, 0, 0};
    // Kept open, so that the terminal outlives the program.
    EXPECT_EQ(::openpty(&terminal_, &program_side_, nullptr, nullptr, &size), 0);
    before_ = settings();
    pid_ = ::fork();
    if (pid_ == 0) {
      ::close(terminal_);
      ::login_tty(program_side_);
      std::vector<char*> words;
      for (const std::string& word : command) {
        words.push_back(const_cast<char*>(word.c_str()));
      }
      words.push_back(nullptr);
      ::setenv("TERM", "xterm", 1);
      ::execv(words[0], words.data());
      ::_exit(127);
    }
  }
  ~Terminal() {
    if (pid_ > 0) {
      ::kill(pid_, SIGKILL);
      ::waitpid(pid_, nullptr, 0);
    }
    ::close(program_side_);
    ::close(terminal_);
  }
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  bool says(const std::string& text) {
    return eventually([&] {
      read();
      return said_.find(text) != std::string::npos;
    });
  }
  void type(char key) { EXPECT_EQ(::write(terminal_, &key, 1), 1); }
  int wait() {
    int status = 0;
    EXPECT_TRUE(eventually([&] {
      read();
      return ::waitpid(pid_, &status, WNOHANG) == pid_;
    }));
    pid_ = -1;
    // The kernel passes the output on later, and in order. So all of it has come when this has.
    const std::string end = "<end of the program>";
    EXPECT_EQ(::write(program_side_, end.data(), end.size()), static_cast<ssize_t>(end.size()));
    EXPECT_TRUE(says(end));
    said_.resize(said_.size() - end.size());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  const std::string& said() const { return said_; }
  void resize(unsigned short rows, unsigned short columns) {
    const winsize size{rows, columns, 0, 0};
    EXPECT_EQ(::ioctl(terminal_, TIOCSWINSZ, &size), 0);
  }
  /// Waits until the program handles signals. Before that a signal ends it.
  bool hears_signals() const {
    return eventually([&] {
      const std::filesystem::directory_iterator threads(fmt::format("/proc/{}/task", pid_));
      return std::distance(begin(threads), end(threads)) > 1;
    });
  }
  /// Waits until no signal is pending, or the program has ended.
  bool has_taken_signals() const {
    return eventually([&] {
      std::ifstream status(fmt::format("/proc/{}/status", pid_));
      bool none_is_pending = true;
      for (std::string line; std::getline(status, line);) {
        none_is_pending =
            none_is_pending && (!line.starts_with("ShdPnd:") || line.find_first_not_of("0\t", 7) == std::string::npos);
      }
      return none_is_pending;
    });
  }
  /// Expects the first screen, a visible cursor, line wrap, and echoed input.
  void expect_as_it_was() const {
    const termios now = settings();
    EXPECT_EQ(now.c_iflag, before_.c_iflag);
    EXPECT_EQ(now.c_oflag, before_.c_oflag);
    EXPECT_EQ(now.c_cflag, before_.c_cflag);
    EXPECT_EQ(now.c_lflag, before_.c_lflag);
    EXPECT_TRUE(std::ranges::equal(now.c_cc, before_.c_cc));
    for (const char* mode : {"\x1b[?1049", "\x1b[?25", "\x1b[?7"}) {
      const std::size_t last = said_.rfind(mode);
      ASSERT_NE(last, std::string::npos) << said_;
      EXPECT_EQ(said_[last + std::strlen(mode)], std::string_view(mode) == "\x1b[?1049" ? 'l' : 'h') << mode;
    }
  }

 private:
  termios settings() const {
    termios settings{};
    EXPECT_EQ(::tcgetattr(program_side_, &settings), 0);
    return settings;
  }
  void read() {
    pollfd input{terminal_, POLLIN, 0};
    std::array<char, 4096> bytes{};
    while (::poll(&input, 1, 10) > 0) {
      const ssize_t got = ::read(terminal_, bytes.data(), bytes.size());
      if (got <= 0) {
        return;
      }
      said_.append(bytes.data(), static_cast<std::size_t>(got));
    }
  }
  pid_t pid_ = -1;
  int terminal_ = -1, program_side_ = -1;
  termios before_{};
  std::string said_;
};

TEST_F(FarmCliTest, TopShowsTheFarmUntilItIsLeft) {
  submit({scene("cornell-bench-blocks.json"), "--size", "96x80", "--spp", "100000", "--name", "long"});
  start_worker("w1");
  ASSERT_TRUE(eventually([&] { return on_farm({"top"})["workers"].size() == 1; }));
  const CommandResult once = lightmill({"top", "--server", server()});
  EXPECT_EQ(once.exit_code, 0) << once.err;
  EXPECT_NE(once.out.find("w1"), std::string::npos) << once.out;
  EXPECT_EQ(once.out.find('\x1b'), std::string::npos) << "no terminal";

  Terminal terminal({program("lightmill"), "top", "--server", server(), "--interval", "0.2s"}, 24, 100);
  EXPECT_TRUE(terminal.says("1 working")) << terminal.said();
  EXPECT_TRUE(terminal.says("long")) << terminal.said();
  on_farm({"cancel", "1"});
  EXPECT_TRUE(terminal.says("jobs     none")) << terminal.said();
  terminal.type('q');
  EXPECT_EQ(terminal.wait(), 0);
  EXPECT_TRUE(terminal.said().starts_with("\x1b[?1049h"));
  terminal.expect_as_it_was();
}

TEST_F(FarmCliTest, TopDrawsAgainWhenTheWindowGrows) {
  Terminal terminal({program("lightmill"), "top", "--server", server(), "--interval", "1h"}, 24, 20);
  ASSERT_TRUE(terminal.says("workers  none")) << terminal.said();
  EXPECT_EQ(terminal.said().find("jobs could keep"), std::string::npos);
  terminal.resize(24, 100);
  EXPECT_TRUE(terminal.says("jobs could keep")) << terminal.said();
}

TEST_F(FarmCliTest, TopPrintsOnceInATerminalThatCannotRedraw) {
  Terminal terminal({"/usr/bin/env", "TERM=dumb", program("lightmill"), "top", "--server", server()}, 24, 100);
  EXPECT_EQ(terminal.wait(), 0);
  EXPECT_NE(terminal.said().find("jobs     none"), std::string::npos) << terminal.said();
  EXPECT_EQ(terminal.said().find('\x1b'), std::string::npos) << terminal.said();
}

TEST_F(FarmCliTest, CtrlZDoesNotSuspendTop) {
  Terminal terminal({program("lightmill"), "top", "--server", server()}, 24, 100);
  ASSERT_TRUE(terminal.says("workers  none")) << terminal.said();
  for (const char key : {'\x1a', '\x1c', 'q'}) {
    terminal.type(key);
  }
  EXPECT_EQ(terminal.wait(), 0);
  terminal.expect_as_it_was();
}

/// A coordinator that neither answers nor closes connections.
class SilentFarmTest : public FarmCliTest {
 protected:
  /// The keys end `top`, and the terminal is as before.
  void expect_leaves(const std::string& keys, const std::set<int>& codes) {
    Terminal terminal({program("lightmill"), "top", "--server", server(), "--interval", "0.1s"}, 24, 100);
    ASSERT_TRUE(terminal.says("workers  none")) << terminal.said();
    server_->send(SIGSTOP);
    ASSERT_TRUE(terminal.says("out of date: no answer for ")) << terminal.said();
    for (const char key : keys) {
      terminal.type(key);
      EXPECT_TRUE(terminal.has_taken_signals());  // two at once may arrive as one
    }
    const int code = terminal.wait();
    EXPECT_TRUE(codes.contains(code)) << code;
    terminal.expect_as_it_was();
    server_->send(SIGCONT);
  }
};

TEST_F(SilentFarmTest, QEndsTop) {
  expect_leaves("q", {0});
  expect_leaves("\x03", {0});
}

TEST_F(SilentFarmTest, ASecondCtrlCRestoresTheTerminal) {
  expect_leaves("\x03\x03", {0, 130});
}

TEST_F(SilentFarmTest, CtrlCEndsTheFirstRequest) {
  server_->send(SIGSTOP);
  Terminal terminal({program("lightmill"), "top", "--server", server()}, 24, 100);
  ASSERT_TRUE(terminal.hears_signals());
  terminal.type('\x03');
  EXPECT_EQ(terminal.wait(), 130);
}

// Without an interrupt a call ends after 30 s, with another error.
TEST_F(SilentFarmTest, InterruptedCallsEndAsCancelled) {
  cli::CoordinatorClient connection(server());
  ASSERT_TRUE(connection.probe(std::chrono::seconds(60)).ok());
  server_->send(SIGSTOP);
  const std::vector<std::function<Status()>> calls{[&] { return connection.list_jobs({}, 20).status(); },
                                                   [&] { return connection.list_workers().status(); }};
  for (const std::function<Status()>& call : calls) {
    Status ended;
    {
      const cli::AsyncCall<bool> looking(
          [&]() -> Result<bool> {
            ended = call();
            return true;
          },
          [&] { connection.cancel_calls(); });
    }
    EXPECT_EQ(ended.code(), StatusCode::kCancelled) << ended;
  }
  server_->send(SIGCONT);
}

TEST_F(SilentFarmTest, TopResumesWhenTheFarmAnswersAgain) {
  Terminal terminal({program("lightmill"), "top", "--server", server(), "--interval", "0.1s"}, 24, 100);
  ASSERT_TRUE(terminal.says("jobs     none")) << terminal.said();
  server_->send(SIGSTOP);
  ASSERT_TRUE(terminal.says("no answer for ")) << terminal.said();
  server_->send(SIGCONT);
  submit({scene("cornell-bench-blocks.json"), "--size", "96x80", "--spp", "8"});
  EXPECT_TRUE(terminal.says("jobs     1 queued")) << terminal.said();
}

TEST_F(FarmCliTest, TopSaysWhenTheFarmIsAway) {
  Terminal terminal({program("lightmill"), "top", "--server", server(), "--interval", "0.2s"}, 24, 100);
  ASSERT_TRUE(terminal.says("workers  none")) << terminal.said();
  stop_server();
  EXPECT_TRUE(terminal.says("out of date: ")) << terminal.said();
  terminal.type('\x03');
  EXPECT_EQ(terminal.wait(), 0);
  EXPECT_EQ(lightmill({"top", "--server", server()}).exit_code, 3);
}

}  // namespace
}  // namespace lightmill::test

// Fixtures for the command line: the real program, and real farms of real processes.
#pragma once

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/paths.h"
#include "tests/support/process.h"
#include "tests/support/reserved_port.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {

/// Options of a short render.
inline const std::vector<std::string> kSmall{"--size", "96x80", "--spp", "8"};

/// The arguments, then `more`.
inline std::vector<std::string> with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

inline std::string scene(const std::string& name) {
  return source_file("scenes/" + name);
}

class CliTest : public ::testing::Test {
 protected:
  /// Runs `lightmill` in an environment without a farm, with its own directory for temporary files.
  CommandResult lightmill(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), program("lightmill"));
    return run_command(arguments, environment());
  }
  /// The same with --json. Returns the printed object.
  nlohmann::json json(std::vector<std::string> arguments, int exit_code = 0) const {
    arguments.emplace_back("--json");
    const CommandResult result = lightmill(std::move(arguments));
    EXPECT_EQ(result.exit_code, exit_code) << result.out << result.err;
    EXPECT_EQ(std::count(result.out.begin(), result.out.end(), '\n'), 1) << result.out;
    return nlohmann::json::parse(result.out, nullptr, false);
  }
  Environment environment() const {
    Environment variables{{"TMPDIR", temporary()}};
    for (const char* name :
         {"COLUMNS", "LIGHTMILL_SERVER", "LIGHTMILL_TLS_CA", "LIGHTMILL_TLS_CERT", "LIGHTMILL_TLS_KEY"}) {
      variables[name] = "";
    }
    return variables;
  }
  std::string temporary() const { return folder_.path().string(); }
  std::string file(const std::string& name) const { return (files_.path() / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
    return file(name);
  }
  /// Processes that this test's commands started and that still run.
  std::vector<pid_t> left_over() const { return processes_with("TMPDIR", temporary()); }
  bool temporary_is_empty() const { return std::filesystem::is_empty(temporary()); }

 private:
  test::TemporaryFolder folder_, files_;
};

/// A fixture with a farm for its commands.
class OnFarmTest : public CliTest {
 protected:
  /// The address of its coordinator.
  virtual std::string server() const = 0;
  /// Runs a command on this farm.
  nlohmann::json on_farm(std::vector<std::string> arguments, int exit_code = 0) const {
    arguments.insert(arguments.end(), {"--server", server()});
    return json(std::move(arguments), exit_code);
  }
  std::string submit(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "submit");
    return std::to_string(on_farm(std::move(arguments)).value("id", 0));
  }
};

/// The port of a coordinator with `--port-file`, or empty while the file is missing.
inline std::string port_in(const std::string& file) {
  std::string text;
  std::ifstream(file) >> text;
  return text;
}

/// A farm of one worker that all tests of a program share. It also has the jobs of other tests, so tests here may only
/// render and read.
class SharedFarmTest : public OnFarmTest {
 protected:
  std::string server() const override { return running().address; }
  ~SharedFarmTest() override {
    EXPECT_TRUE(running().coordinator.runs());
    EXPECT_TRUE(running().worker->runs());
  }

 private:
  struct Running {
    Running()
        : coordinator({program("lightmill-server"), "--data", file("data"), "--listen", "127.0.0.1:0", "--port-file",
                       file("port")},
                      file("server.log")) {
      EXPECT_TRUE(eventually([&] { return !port_in(file("port")).empty(); }));
      address = "127.0.0.1:" + port_in(file("port"));
      worker.emplace(std::vector<std::string>{program("lightmill-worker"), "--server", address, "--threads", "2"},
                     file("worker.log"));
    }
    std::string file(const std::string& name) const { return (folder.path() / name).string(); }

    TemporaryFolder folder;
    BackgroundProcess coordinator;
    std::optional<BackgroundProcess> worker;
    std::string address;
  };
  static Running& running() {
    static Running one;
    return one;
  }
};

/// A farm for one test: a coordinator, and workers as asked for.
class FarmCliTest : public OnFarmTest {
 protected:
  /// Starts it at a port that is still free when it restarts.
  void SetUp() override { start_server(fmt::format("127.0.0.1:{}", reserved_.number())); }

  void start_server(const std::string& listen, const std::vector<std::string>& options = {}) {
    std::filesystem::remove(file("port"));
    std::vector<std::string> command{
        program("lightmill-server"), "--data", file("data"), "--listen", listen, "--port-file", file("port")};
    command.insert(command.end(), options.begin(), options.end());
    server_ = std::make_unique<BackgroundProcess>(command, file("server.log"));
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(file("port")) && !port().empty(); }));
  }
  void stop_server() {
    server_->send(SIGTERM);
    EXPECT_EQ(server_->wait(), 0);
  }
  std::string port() const { return port_in(file("port")); }
  std::string server() const override { return "127.0.0.1:" + port(); }
  /// Waits until the coordinator's log has this text.
  bool server_said(const std::string& text) const {
    return eventually([&] {
      std::ifstream log(file("server.log"));
      return std::string(std::istreambuf_iterator<char>(log), {}).find(text) != std::string::npos;
    });
  }
  void start_worker(const std::string& name, const std::vector<std::string>& options = {},
                    const std::string& coordinator = "") {
    std::vector<std::string> command{program("lightmill-worker"),
                                     "--server",
                                     coordinator.empty() ? server() : coordinator,
                                     "--name",
                                     name,
                                     "--threads",
                                     "2"};
    command.insert(command.end(), options.begin(), options.end());
    workers_.push_back(std::make_unique<BackgroundProcess>(command, file(name + ".log")));
  }

  const ReservedPort reserved_;
  std::unique_ptr<BackgroundProcess> server_;
  std::vector<std::unique_ptr<BackgroundProcess>> workers_;
};

}  // namespace lightmill::test

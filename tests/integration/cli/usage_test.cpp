// Errors in commands are reported at once: exit code 2 and nothing submitted, or 3 without a farm.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <thread>

#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

TEST_F(CliTest, BadUsageIsExitCode2WithAReason) {
  const std::string box = scene("cornell-bench-blocks.json");
  const std::string large_secret = write("large", std::string(5'000, 'x'));
  ASSERT_EQ(::chmod(large_secret.c_str(), 0600), 0);
  const std::vector<std::vector<std::string>> commands{
      {},
      {"frobnicate"},
      {"render"},
      {"render", box, "--spp", "0"},
      {"render", box, "--spp", "many"},
      {"render", box, "--seconds", "-3"},
      {"render", box, "--spp", ""},
      {"render", box, "--seconds", ""},
      {"render", box, "--error", ""},
      {"extend", "1", "--error", ""},
      {"render", box, "--seconds", "1e300"},
      {"render", box, "--spp", "1e3"},
      {"render", box, "--seed", "-1"},
      {"render", box, "--seed", "18446744073709551616"},
      {"render", box, "--priority", "2147483648"},
      {"render", box, "--exposure", "nan"},
      {"render", box, "--gamma", "0"},
      {"render", box, "--name", "a\nb\x1b[31mred"},
      {"submit", box, "--owner", std::string(201, 'x')},
      {"submit", box, "--name", "\xff"},
      {"show", "-1"},
      {"show", "1", "--chart", "/nonexistent/chart.svg"},
      {"jobs", "--limit", "1", "--limit", "2"},
      {"render", box, "--size", "12"},
      {"render", box, "--size", "0x4"},
      {"render", box, "--crop", "500,500,64,64"},
      {"render", box, "--crop", "1,2,3"},
      {"render", box, "--method", "magic"},
      {"render", box, "--method", "ao:distance=0"},
      {"render", box, "--method", "whitted", "--max-bounces", "129"},
      {"render", box, "--view", "sepia"},
      {"render", box, "-o", file("a.jpg")},
      {"render", box, "-o", file("nowhere/a.png")},
      {"render", box, "-o", file(std::string(251, 'a') + ".png")},
      {"render", box, "-o", "/proc/a.png"},
      {"render", box, "--server", "no-port"},
      {"jobs", "--server", "::1:7350"},
      {"top", "--interval", "0.09s"},
      {"render", box, "--camera", file("none.json")},
      {"render", box, "--mtl", "magic"},
      {"render", box, "--sky", "blue"},
      {"render", box, "--camera", "1"},
      {"render", box, "-o", file("a.exr"), "--gamma", "2"},
      {"fetch", "1", "-o", file("a.exr"), "--exposure", "1"},
      {"watch", "1", "--view", "filmic"},
      {"render", box, "--local", "--server", "127.0.0.1:1"},
      {"render", box, "--method", "ao", "--max-bounces", "3"},
      {"submit", box, "--method", "raycast", "--max-bounces", "3"},
      {"check", file("a.blend"), file("b.blend")},
      {"render", box, "--mtl", "course"},
      {"check", box, "--mtl", "standard"},
      {"check", box, "--save-camera", file("nowhere/a.json")},
      {"check", box, "--save-camera", box},
      {"certs", "init", "/proc/certs"},
      {"render", box, "-o", file("a.png"), "-o", file("./a.png")},
      {"render", box, "-o", file("a.exr"), file("b.png")},
      {"render", box, "--layers", ""},
      {"show", "1", "--chart", ""},
      {"show", "1", "--chart", file("a.png")},
      {"check", box, "--save-camera", ""},
      {"jobs", "--server", ""},
      {"jobs", "--tls-cert", ""},
      {"jobs", "--tls-key", ""},
      {"jobs", "--tls-ca", ""},
      {"jobs", "--token-file", ""},
      {"jobs", "--token-file", large_secret},
      {"render", box, "--name", ""},
      {"render", ""},
      {"verify", file("a.exr"), box, "--share", "none"},
      {"verify", file("a.exr"), box, "--share", "0%"},
      {"render", box, "--size", ""},
      {"render", box, "--crop", ""},
      {"render", box, "--camera", ""},
      {"submit"},
      {"watch"},
      {"watch", "seven"},
      {"fetch", "1"},
      {"extend", "1"},
      {"priority", "1"},
      {"priority", "1", "--to", "high"},
      {"priority", "1", "--to", "2147483648"},
      {"jobs", "--server", "host:99999"},
      {"error", file("a.png")},
      {"error", file("a.png"), file("b.png")},
      {"check", file("none.json")},
  };
  for (const auto& command : commands) {
    const CommandResult result = lightmill(command);
    const std::string shown = command.empty() ? "(nothing)" : command.back();
    EXPECT_EQ(result.exit_code, 2) << shown << result.out << result.err;
    EXPECT_TRUE(result.err.starts_with("lightmill: ")) << shown << result.err;
    EXPECT_EQ(result.err.find('\x1b'), std::string::npos) << shown;
    EXPECT_EQ(result.out, "") << shown;
  }
  EXPECT_TRUE(temporary_is_empty());
}

TEST_F(CliTest, EmptyValuesAreRefusedByAllPrograms) {
  const std::string why = ": a value is expected, got an empty one";
  for (const char* option : {"--store", "--data", "--listen", "--tls-cert", "--tls-key", "--http", "--log-level"}) {
    const CommandResult result = run_command({program("lightmill-server"), option, ""}, environment());
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_TRUE(result.err.starts_with(fmt::format("lightmill-server: {}{}", option, why))) << result.err;
  }
  for (const char* option : {"--server", "--name", "--token-file"}) {
    const CommandResult result = run_command({program("lightmill-worker"), option, ""}, environment());
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_TRUE(result.err.starts_with(fmt::format("lightmill-worker: {}{}", option, why))) << result.err;
  }
  EXPECT_TRUE(lightmill({"jobs", "--tls-ca", ""}).err.starts_with(fmt::format("lightmill: --tls-ca{}", why)));
}

TEST_F(CliTest, OptionsOverrideVariablesInAllCommands) {
  Environment all = environment();
  for (const char* name : {"LIGHTMILL_TLS_CA", "LIGHTMILL_TLS_CERT", "LIGHTMILL_TOKEN_FILE"}) {
    all[name] = file("of-the-environment");
  }
  const std::vector<std::vector<std::string>> commands{
      {"jobs"}, {"workers"}, {"watch", "1"}, {"delete", "1"}, {"tokens"}, {"log"}, {"workers", "drain", "w"}};
  for (std::vector<std::string> command : commands) {
    command.insert(command.begin(), program("lightmill"));
    const CommandResult from_variables = run_command(command, all);
    EXPECT_EQ(from_variables.exit_code, 2);
    EXPECT_TRUE(from_variables.err.starts_with("lightmill: --tls-ca " + file("of-the-environment")))
        << from_variables.err;
    EXPECT_NE(from_variables.err.find("(set in the environment: LIGHTMILL_TLS_CA, LIGHTMILL_TLS_CERT, "),
              std::string::npos)
        << from_variables.err;
    command.insert(command.end(), {"--tls-ca", file("given")});
    const CommandResult given = run_command(command, all);
    EXPECT_EQ(given.exit_code, 2);
    EXPECT_TRUE(given.err.starts_with("lightmill: --tls-ca " + file("given"))) << given.err;
  }
  const CommandResult before =
      run_command({program("lightmill"), "workers", "--tls-ca", file("given"), "drain", "w"}, all);
  EXPECT_TRUE(before.err.starts_with("lightmill: --tls-ca " + file("given"))) << before.err;
}

TEST_F(CliTest, AMissingFarmIsReported) {
  for (const auto& [address, cause] :
       {std::pair("127.0.0.1:1", "nothing listens there. Start lightmill-server, or give another --server"),
        std::pair("unknown.invalid:7350", "unknown host name")}) {
    const CommandResult result = lightmill({"jobs", "--server", address});
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_EQ(result.err, fmt::format("lightmill: cannot reach the farm at {}: {}\n", address, cause));
  }
}

TEST_F(CliTest, AnotherProgramAtTheAddressIsReportedWithARemedy) {
  const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ASSERT_EQ(::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size), 0);
  ASSERT_EQ(::listen(listener, 16), 0);
  std::thread other([listener] {
    for (int caller = 0; (caller = ::accept(listener, nullptr, nullptr)) >= 0;) {
      ::close(caller);
    }
  });
  const std::string at = fmt::format("127.0.0.1:{}", ntohs(address.sin_port));
  const CommandResult result = lightmill({"jobs", "--server", at});
  ::shutdown(listener, SHUT_RDWR);
  other.join();
  ::close(listener);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(
      result.err,
      fmt::format("lightmill: cannot reach the farm at {}: no coordinator answers there. Check the address and the "
                  "firewall\n",
                  at));
}

TEST_F(CliTest, AnAddressOfAPageIsNoAddressOfAFarm) {
  const CommandResult result = lightmill({"jobs", "--server", "http://farm.example:7350"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err,
            "lightmill: --server is HOST:PORT of the coordinator's gRPC port: write farm.example:7350, not "
            "http://farm.example:7350\n");
}

TEST_F(CliTest, AWorkersNameIsCheckedBeforeItStarts) {
  for (const std::string& name : {std::string("a\nb"), std::string(300, 'n')}) {
    const CommandResult result = run_command({program("lightmill-worker"), "--name", name}, environment());
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_TRUE(result.err.starts_with("lightmill-worker: --name: ")) << result.err;
  }
}

TEST_F(CliTest, AFileThatCannotBeWrittenIsNamedAsGiven) {
  const std::string box = scene("cornell-bench-blocks.json");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"check", box, "--save-camera", "/proc/a.png"}, {"render", box, "-o", "/proc/a.png"}}) {
    const CommandResult result = lightmill(command);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err, "lightmill: cannot write /proc/a.png: No such file or directory\n");
  }
}

TEST_F(CliTest, OptionsBeforeTheCommandAreShownBehindIt) {
  const CommandResult result = lightmill({"--server", "127.0.0.1:1", "jobs", "--all"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.err,
            "lightmill: --server must follow its command: `lightmill jobs --all --server 127.0.0.1:1`\n"
            "Try `lightmill help jobs`.\n");
}

TEST_F(CliTest, UnknownHelpNamesTheHelpThatExists) {
  for (const auto& [words, text] :
       {std::pair{std::vector<std::string>{"zzz"}, "unknown command or topic 'zzz'\nTry `lightmill help`.\n"},
        {{"methds"}, "unknown command or topic 'methds'. Did you mean 'methods'?\nTry `lightmill help`.\n"},
        {{"workers", "drian"},
         "unknown command 'workers drian'. Did you mean 'drain'?\nTry `lightmill help workers`.\n"},
        {{"render", "jobs"},
         "`lightmill help` explains one command or topic at a time, got 'render jobs'\nTry `lightmill help render`.\n"},
        {{"methods", "layers"},
         "`lightmill help` explains one command or topic at a time, got 'methods layers'\n"
         "Try `lightmill help methods`.\n"}}) {
    std::vector<std::string> command{"help"};
    command.insert(command.end(), words.begin(), words.end());
    const CommandResult result = lightmill(command);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(result.err, fmt::format("lightmill: {}", text));
  }
}

TEST_F(CliTest, BadIntervalsHaveOneErrorWithTheLimits) {
  for (const char* interval : {"0", "0.05", "2d", "nan", "soon"}) {
    EXPECT_EQ(lightmill({"top", "--interval", interval}).err,
              fmt::format("lightmill: --interval: a time from 0.1s to 1d is expected, such as 0.5s or 1m, got '{}'\n"
                          "Try `lightmill help top`.\n",
                          interval));
  }
}

TEST_F(CliTest, ErrorsAreAnObjectWithJson) {
  const nlohmann::json usage = json({"jobs", "--nonsense"}, 2);
  EXPECT_EQ(usage["failure"]["exit_code"], 2);
  EXPECT_NE(usage["failure"]["message"].get<std::string>().find("--nonsense"), std::string::npos);
  EXPECT_EQ(json({"check", file("none.json")}, 2)["failure"]["exit_code"], 2);
}

TEST_F(CliTest, ResultsThatCannotBeWrittenAreAnError) {
  for (const std::string more : {"", " --json"}) {
    const CommandResult result =
        run_command({"/bin/sh", "-c",
                     program("lightmill") + " check " + scene("cornell-bench-blocks.json") + more + " > /dev/full"},
                    environment());
    EXPECT_EQ(result.exit_code, 1) << result.err;
    EXPECT_NE(result.err.find("standard output"), std::string::npos) << result.err;
  }
}

TEST_F(CliTest, TheReasonOfAFailedWriteIsNamed) {
  const std::string check = " check " + scene("cornell-bench-blocks.json");
  for (const auto& [command, reason] :
       {std::pair<std::string, std::string>{" --help >/dev/full", "No space left on device"},
        {" help methods >/dev/full", "No space left on device"},
        {check + " >/dev/full", "No space left on device"},
        {" --help >&-", "Bad file descriptor"},
        {check + " >&-", "Bad file descriptor"},
        {check + " <&- >&-", "Bad file descriptor"}}) {
    const CommandResult result = run_command({"/bin/sh", "-c", program("lightmill") + command}, environment());
    EXPECT_EQ(result.exit_code, 1) << command;
    EXPECT_NE(result.err.find("lightmill: cannot write to standard output: " + reason), std::string::npos)
        << command << ": " << result.err;
  }
}

TEST_F(CliTest, DenoisingWithoutAPictureToShowItIsRefused) {
  const std::string box = scene("cornell-bench-blocks.json");
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"render", box}, {"fetch", "1", "--server", "127.0.0.1:1"}}) {
    const CommandResult result =
        lightmill(with(command, {"--denoise", "--png-layer", "normal", "-o", file("normals.png")}));
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_EQ(
        result.err,
        "lightmill: --denoise has no effect with --png-layer, because PNG files then show a layer: leave out one of "
        "them, or add -o FILE.exr\n");
  }
}

TEST_F(CliTest, AnUnknownCommandIsReportedWithTheKnownOnes) {
  const CommandResult result = lightmill({"frobnicate"});
  for (const char* word : {"frobnicate", "render", "check"}) {
    EXPECT_NE(result.err.find(word), std::string::npos) << result.err;
  }
}

TEST_F(FarmCliTest, NothingIsSubmittedIfASceneOrOptionIsInvalid) {
  const std::string empty = write("empty.obj", "v 0 0 0\n");
  const std::string box = scene("cornell-bench-blocks.json");
  write("sky.exr", "no image");
  const std::string sky = write("sky.json",
                                R"({"camera": {"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1},
"lights": [{"environment": {"file": "sky.exr"}}], "materials": [{"name": "m", "mirror": {}}],
"objects": [{"sphere": {"center": [0, 0, 0], "radius": 1}, "material": "m"}]})");
  EXPECT_NE(lightmill({"check", sky}).err.find("sky.json:2:"), std::string::npos);
  for (const std::vector<std::string>& arguments : {std::vector<std::string>{"submit", empty},
                                                    {"render", empty},
                                                    {"submit", sky},
                                                    {"render", box, "--crop", "0,0,513,1"}}) {
    on_farm(arguments, 2);
  }
  EXPECT_TRUE(on_farm({"jobs"})["jobs"].empty());
}

TEST_F(FarmCliTest, UnknownJobsAndWorkersAreExitCode2) {
  for (const char* command : {"show", "watch", "cancel", "pause", "resume", "delete"}) {
    const nlohmann::json answer = on_farm({command, "77"}, 2);
    EXPECT_NE(answer["failure"]["message"].get<std::string>().find("77"), std::string::npos) << command;
  }
  on_farm({"extend", "77", "--spp", "4"}, 2);
  on_farm({"priority", "77", "--to", "-4"}, 2);
  on_farm({"fetch", "77", "-o", file("a.png")}, 2);
  on_farm({"workers", "drain", "unknown"}, 2);
}

/// A port without a listener. It is bound, so that no other process takes it.
class ClosedPort {
 public:
  ClosedPort() : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    address_ = "127.0.0.1:" + std::to_string(ntohs(address.sin_port));
  }
  ~ClosedPort() { ::close(socket_); }
  const std::string& address() const { return address_; }

 private:
  int socket_;
  std::string address_;
};

TEST_F(CliTest, AFarmThatCannotBeReachedIsExitCode3) {
  const ClosedPort closed;
  const std::vector<std::vector<std::string>> commands{
      {"jobs"},
      {"workers"},
      {"workers", "drain", "x"},
      {"show", "1"},
      {"watch", "1"},
      {"pause", "1"},
      {"fetch", "1", "-o", file("a.exr")},
      {"render", scene("cornell-bench-blocks.json"), "-o", file("a.exr")}};
  for (std::vector<std::string> command : commands) {
    const std::string name = command.front();
    command.insert(command.end(), {"--server", closed.address()});
    const CommandResult result = lightmill(command);
    EXPECT_EQ(result.exit_code, 3) << name << result.err;
    EXPECT_NE(result.err.find(closed.address()), std::string::npos) << name << result.err;
  }
}

TEST_F(CliTest, TheEnvironmentNamesTheFarm) {
  const ClosedPort closed;
  Environment with = environment();
  with["LIGHTMILL_SERVER"] = closed.address();
  const CommandResult result = run_command({program("lightmill"), "jobs"}, with);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_NE(result.err.find(closed.address()), std::string::npos) << result.err;
}

TEST_F(CliTest, EveryCommandHasHelp) {
  const CommandResult all = lightmill({"--help"});
  EXPECT_EQ(all.exit_code, 0);
  for (const char* command : {"render", "submit", "watch", "fetch", "jobs", "show", "cancel", "pause", "resume",
                              "priority", "extend", "delete", "workers", "error", "check"}) {
    EXPECT_NE(all.out.find(command), std::string::npos) << command;
    const CommandResult help = lightmill({command, "--help"});
    EXPECT_EQ(help.exit_code, 0) << command;
    EXPECT_NE(help.out.find("--json"), std::string::npos) << command;
  }
}

TEST_F(FarmCliTest, ThreadsNeedALocalFarm) {
  const nlohmann::json answer = on_farm({"render", scene("cornell-bench-blocks.json"), "--threads", "2"}, 2);
  EXPECT_EQ(answer["failure"]["message"],
            "--threads applies only to a local farm, but --server names a farm: leave out --threads, or give --local "
            "instead");
}

TEST_F(CliTest, ALongLineThatTakesTooMuchMemoryIsAnErrorWithItsFile) {
  constexpr std::size_t kLineBytes = std::size_t{48} << 20;
  const auto repeated = [](const std::string& words) {
    std::string line;
    while (line.size() < kLineBytes) {
      line += words;
    }
    return line;
  };
  const auto check = [&](const std::string& scene) {
    return run_command({"/bin/sh", "-c", "ulimit -v 1000000; exec \"$@\"", "sh", program("lightmill"), "check", scene},
                       environment());
  };
  const std::string document = write("objects.json", "{\"objects\": [" + repeated("{}, ") + "{}]}");
  const CommandResult objects = check(document);
  EXPECT_EQ(objects.exit_code, 2);
  EXPECT_EQ(objects.err, "lightmill: " + document + ":1:13: objects: at most 1000000 are possible, got more\n");
  const std::string polygon = write("face.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf " + repeated("1 2 3 ") + "\n");
  const CommandResult face = check(polygon);
  EXPECT_EQ(face.exit_code, 2);
  EXPECT_EQ(face.err.find("lightmill: " + polygon + ": reading it needs more memory"), 0u) << face.err;
}

TEST_F(CliTest, ProgramsWithoutEnoughMemorySaySoAndEnd) {
  const std::string port_file = file("port");
  const std::vector<std::vector<std::string>> programs{
      {program("lightmill-server"), "--listen", "127.0.0.1:0", "--data", file("data"), "--port-file", port_file},
      {program("lightmill-worker"), "--server", "127.0.0.1:9", "--threads", "2"},
      {program("lightmill-worker"), "--server", "127.0.0.1:9", "--threads", "4"}};
  for (const std::vector<std::string>& arguments : programs) {
    const std::string name = std::filesystem::path(arguments.front()).filename();
    int refused = 0;
    for (const int kib : {90'000, 160'000, 300'000, 331'250, 400'000}) {
      std::vector<std::string> limited{"/bin/sh", "-c", fmt::format("ulimit -v {}; exec \"$@\"", kib), "sh"};
      limited.insert(limited.end(), arguments.begin(), arguments.end());
      const std::string log = file(fmt::format("{}-{}-{}.log", name, &arguments - programs.data(), kib));
      std::filesystem::remove(port_file);
      BackgroundProcess process(limited, log, environment());
      process.allow_faults();  // a thread that cannot start terminates the program, which then says why
      const auto said = [&] { return read_file(log).value_or(""); };
      std::optional<int> code;
      EXPECT_TRUE(eventually([&] {
        code = process.wait(std::chrono::milliseconds(0));
        return code || std::filesystem::exists(port_file) || said().find("no connection to") != std::string::npos;
      })) << said();
      if (!code) {
        process.send(SIGTERM);
        EXPECT_EQ(process.wait(), 0) << kib << ": " << said();
        continue;
      }
      ++refused;
      EXPECT_EQ(*code, 1) << kib << ": " << said();
      const std::string words = fmt::format(
          "{}: it needs more memory than the {} MiB that this process may have (ulimit -v): run it on a "
          "machine with more memory\n",
          name, kib / 1024);
      // A worker may also run out of memory where it can name the work.
      const bool knows =
          name == "lightmill-worker" && (said().find("out of memory while this worker ran") != std::string::npos ||
                                         said().find("threads that this worker needs can start") != std::string::npos);
      EXPECT_TRUE(knows || said().ends_with(words)) << kib << ": " << said();
    }
    EXPECT_GT(refused, 0) << name << " has none of the limits";
  }
}

}  // namespace
}  // namespace lightmill::test

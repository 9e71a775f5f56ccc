// Integration with other programs: output for farm managers, and connections to image viewers.
#include <regex>
#include <thread>

#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"
#include "tests/support/tev_window.h"

namespace lightmill::test {
namespace {

const std::vector<std::string> kSmallByPath{"--size", "96x80", "--method", "path", "--spp", "40"};

// ---- Open Job Description ----

/// A reader of such lines by the specification: anywhere in a program's output, in any order.
struct OpenJdLines {
  std::vector<double> progress;
  std::vector<std::string> status, fail;
};
OpenJdLines read_openjd(const std::string& out) {
  static const std::regex line("^openjd_([a-z_]+): (.*)$");
  OpenJdLines lines;
  std::istringstream output(out);
  for (std::string text; std::getline(output, text);) {
    std::smatch found;
    if (!std::regex_match(text, found, line)) {
      EXPECT_FALSE(text.starts_with("openjd")) << text;
    } else if (found[1] == "progress") {
      std::size_t read = 0;
      lines.progress.push_back(std::stod(found[2], &read));
      EXPECT_EQ(read, found[2].length()) << text;
    } else {
      EXPECT_TRUE(found[1] == "status" || found[1] == "fail") << text;
      (found[1] == "fail" ? lines.fail : lines.status).push_back(found[2]);
    }
  }
  return lines;
}

using StudioTest = FarmCliTest;

TEST_F(SharedFarmTest, AFarmManagerReceivesTheProgressOfARender) {
  const CommandResult run = lightmill(
      with({"render", scene("cornell-bench-blocks.json"), "-o", file("a.exr"), "--openjd", "--server", server()},
           kSmallByPath));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const OpenJdLines lines = read_openjd(run.out);
  ASSERT_FALSE(lines.progress.empty()) << run.out;
  EXPECT_TRUE(std::ranges::is_sorted(lines.progress));
  EXPECT_GE(lines.progress.front(), 0);
  EXPECT_EQ(lines.progress.back(), 100);
  ASSERT_FALSE(lines.status.empty());
  EXPECT_NE(lines.status.back().find("done in"), std::string::npos) << lines.status.back();
  EXPECT_TRUE(lines.fail.empty());
}

TEST_F(StudioTest, AFarmManagerReceivesTheFailure) {
  const CommandResult run = lightmill({"watch", "7", "--openjd", "--server", server()});
  EXPECT_EQ(run.exit_code, 2);
  const OpenJdLines lines = read_openjd(run.out);
  ASSERT_EQ(lines.fail.size(), 1u) << run.out;
  EXPECT_NE(lines.fail[0].find("7"), std::string::npos);
  EXPECT_NE(lightmill({"watch", "7", "--openjd", "--json", "--server", server()}).exit_code, 0) << "one or the other";
}

TEST_F(CliTest, AFarmManagerReceivesUsageErrors) {
  const std::string box = scene("cornell-bench-blocks.json");
  const std::vector<std::vector<std::string>> commands{
      {"lightmill", "--openjd"},
      {"lightmill", "frobnicate", "--openjd"},
      {"lightmill", "render", "--openjd"},
      {"lightmill", "render", box, "--openjd", "--spp", "0"},
      {"lightmill", "render", box, "--spp", "0", "--openjd"},
      {"lightmill", "watch", "7", "--openjd", "--server", "nonsense"},
      {"lightmill-worker", "--openjd", "--frobnicate"},
      {"lightmill-worker", "--threads", "0", "--openjd"},
      {"lightmill-worker", "--openjd", "--server", "nonsense"},
      {"lightmill-worker", "--openjd", "--log-level", "loud"},
  };
  for (std::vector<std::string> command : commands) {
    command[0] = program(command[0]);
    const std::string words = fmt::format("{}", fmt::join(command, " "));
    const CommandResult run = run_command(command, environment());
    EXPECT_EQ(run.exit_code, 2) << words;
    EXPECT_FALSE(run.err.empty()) << words;
    const OpenJdLines lines = read_openjd(run.out);
    EXPECT_EQ(lines.fail.size(), 1u) << words << "\n" << run.out;
    std::erase(command, "--openjd");
    command.emplace_back("--frobnicate");
    EXPECT_EQ(run_command(command, environment()).out, "") << words;
  }
}

TEST_F(StudioTest, AWorkerReportsToItsFarmManager) {
  BackgroundProcess worker(
      {program("lightmill-worker"), "--server", server(), "--threads", "1", "--openjd", "--log-level", "info"},
      file("task.log"));
  ASSERT_TRUE(server_said("connected: 1 thread"));
  worker.send(SIGTERM);
  EXPECT_EQ(worker.wait(), 0);
  std::ifstream log(file("task.log"));
  const OpenJdLines lines = read_openjd(std::string(std::istreambuf_iterator<char>(log), {}));
  const auto says = [&](const std::string& part) {
    return std::ranges::any_of(lines.status,
                               [&](const std::string& text) { return text.find(part) != std::string::npos; });
  };
  EXPECT_TRUE(says("connected to " + server()));
  EXPECT_TRUE(says("leaving"));
  EXPECT_TRUE(lines.fail.empty());
}

// ---- tev ----

/// Reads one connection to its end. `pause`: before each 10,000 bytes.
class Viewer {
 public:
  explicit Viewer(std::uint16_t port = 0, int buffer_bytes = 0, std::chrono::milliseconds pause = {})
      : listener_(port, buffer_bytes), thread_([this, pause] {
          TevWindow window = listener_.accept();
          while (window.read(pause.count() > 0 ? 10000 : 65536)) {
            std::this_thread::sleep_for(pause);
          }
          images_ = window.images();
        }) {}
  ~Viewer() {
    if (thread_.joinable()) {
      thread_.join();
    }
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  std::string address() const { return listener_.address(); }

  /// All images by name, in their final state.
  const std::map<std::string, TevWindow::Image>& images() {
    thread_.join();
    return images_;
  }

 private:
  TevListener listener_;
  std::map<std::string, TevWindow::Image> images_;
  std::thread thread_;
};

/// The viewer has the pixels of the file.
void expect_picture(Viewer& viewer, const std::string& name, const std::string& exr) {
  const auto& images = viewer.images();
  ASSERT_EQ(images.size(), 1u);
  ASSERT_TRUE(images.contains(name)) << images.begin()->first;
  const TevWindow::Image& shown = images.at(name);
  const Result<RgbImage> file = load_rgb(exr);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(shown.width, file->width);
  EXPECT_EQ(shown.height, file->height);
  ASSERT_EQ(shown.planes.size(), file->values.size());
  // One side divides a sum by a count. The other multiplies by the reciprocal, which rounds once more.
  for (std::size_t i = 0; i < shown.planes.size(); ++i) {
    ASSERT_NEAR(shown.planes[i], file->values[i], std::ldexp(std::abs(file->values[i]), -22)) << i;
  }
}

TEST_F(SharedFarmTest, AViewerShowsThePictureThatIsRendered) {
  Viewer viewer;
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmallByPath));
  on_farm({"watch", job, "--tev", viewer.address(), "-o", file("a.exr")});
  expect_picture(viewer, "job " + job + " cornell-bench-blocks", file("a.exr"));
}

TEST_F(SharedFarmTest, ASlowViewerOfAPartOfThePictureGetsAllOfIt) {
  Viewer viewer(0, 16 << 10, std::chrono::milliseconds(2));  // most of some MB still to come at the job's end
  const std::string job = submit({scene("cornell-bench-blocks.json"), "--size", "900x700", "--crop", "10,5,800,600",
                                  "--method", "preview", "--spp", "2"});
  on_farm({"watch", job, "--tev", viewer.address(), "-o", file("a.exr")});
  expect_picture(viewer, "job " + job + " cornell-bench-blocks", file("a.exr"));
}

TEST_F(StudioTest, AViewerThatStartsLaterIsFound) {
  const ReservedPort port;
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmallByPath));
  const std::string address = fmt::format("127.0.0.1:{}", port.number());
  BackgroundProcess watch(
      {program("lightmill"), "watch", job, "--tev", address, "-o", file("a.exr"), "--server", server()},
      file("watch.log"), environment());
  const auto said = [&](const std::string& part) {
    return eventually([&] {
      std::ifstream log(file("watch.log"));
      return std::string(std::istreambuf_iterator<char>(log), {}).find(part) != std::string::npos;
    });
  };
  ASSERT_TRUE(said("no viewer at " + address));
  Viewer viewer(static_cast<std::uint16_t>(port.number()));
  ASSERT_TRUE(said("showing the picture in the viewer at " + address));
  start_worker("w");
  EXPECT_EQ(watch.wait(), 0);
  expect_picture(viewer, "job " + job + " cornell-bench-blocks", file("a.exr"));
}

TEST_F(SharedFarmTest, WatchWithoutAViewerFollowsTheJobAndFails) {
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmallByPath));
  const ReservedPort without_listener;
  const std::string address = fmt::format("127.0.0.1:{}", without_listener.number());
  const CommandResult run = lightmill({"watch", job, "--tev", address, "-o", file("a.exr"), "--server", server()});
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_TRUE(std::filesystem::exists(file("a.exr")));
  EXPECT_NE(run.err.find("start tev or HDRView there"), std::string::npos) << run.err;
  EXPECT_NE(run.err.find("the picture at " + address + " is incomplete"), std::string::npos) << run.err;
  EXPECT_NE(lightmill({"watch", job, "--tev", "nonsense", "--server", server()}).exit_code, 0);
}

TEST_F(SharedFarmTest, TevWithoutAValueUsesTheDefaultAddress) {
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmallByPath));
  ASSERT_EQ(on_farm({"watch", job})["state"], "done");
  // The address is printed with and without a viewer.
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"watch", job, "--tev"}, {"watch", job, "--tev", "-o", file("a.exr")}}) {
    const CommandResult run = lightmill(with(words, {"--server", server()}));
    EXPECT_LE(run.exit_code, 1) << run.err;
    EXPECT_NE(run.err.find("127.0.0.1:14158"), std::string::npos) << run.err;
  }
  EXPECT_TRUE(std::filesystem::exists(file("a.exr")));
  EXPECT_EQ(lightmill({"watch", job, "--server", server()}).err.find("14158"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test

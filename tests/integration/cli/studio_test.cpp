// Beside other programs: what farm managers read from standard output, and what image viewers read from a connection.
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstring>
#include <regex>
#include <thread>

#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

const std::vector<std::string> kSmall{"--size", "96x80", "--method", "path", "--spp", "40"};

std::vector<std::string> with(std::vector<std::string> arguments, const std::vector<std::string>& more) {
  arguments.insert(arguments.end(), more.begin(), more.end());
  return arguments;
}

// ---- Open Job Description ----

/// A reader of such lines, as the specification has them: in any of a program's lines, of any order.
struct Told {
  std::vector<double> progress;
  std::vector<std::string> status, fail;
};
Told read_openjd(const std::string& out) {
  static const std::regex line("^openjd_([a-z_]+): (.*)$");
  Told told;
  std::istringstream lines(out);
  for (std::string text; std::getline(lines, text);) {
    std::smatch found;
    if (!std::regex_match(text, found, line)) {
      EXPECT_FALSE(text.starts_with("openjd")) << text;
    } else if (found[1] == "progress") {
      std::size_t read = 0;
      told.progress.push_back(std::stod(found[2], &read));
      EXPECT_EQ(read, found[2].length()) << text;
    } else {
      EXPECT_TRUE(found[1] == "status" || found[1] == "fail") << text;
      (found[1] == "fail" ? told.fail : told.status).push_back(found[2]);
    }
  }
  return told;
}

using StudioTest = FarmCliTest;

TEST_F(StudioTest, AFarmManagerIsToldHowARenderGoes) {
  start_worker("w");
  const CommandResult run = lightmill(with(
      {"render", scene("cornell-bench-blocks.json"), "-o", file("a.exr"), "--openjd", "--server", server()}, kSmall));
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const Told told = read_openjd(run.out);
  ASSERT_FALSE(told.progress.empty()) << run.out;
  EXPECT_TRUE(std::ranges::is_sorted(told.progress));
  EXPECT_GE(told.progress.front(), 0);
  EXPECT_EQ(told.progress.back(), 100);
  ASSERT_FALSE(told.status.empty());
  EXPECT_NE(told.status.back().find("done in"), std::string::npos) << told.status.back();
  EXPECT_TRUE(told.fail.empty());
}

TEST_F(StudioTest, AFarmManagerIsToldWhatFailed) {
  const CommandResult run = lightmill({"watch", "7", "--openjd", "--server", server()});
  EXPECT_EQ(run.exit_code, 2);
  const Told told = read_openjd(run.out);
  ASSERT_EQ(told.fail.size(), 1u) << run.out;
  EXPECT_NE(told.fail[0].find("7"), std::string::npos);
  EXPECT_NE(lightmill({"watch", "7", "--openjd", "--json", "--server", server()}).exit_code, 0) << "one or the other";
}

TEST_F(CliTest, AFarmManagerIsToldWhatIsWrongWithACommandLine) {
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
    const Told told = read_openjd(run.out);
    EXPECT_EQ(told.fail.size(), 1u) << words << "\n" << run.out;
    std::erase(command, "--openjd");
    command.emplace_back("--frobnicate");
    EXPECT_EQ(run_command(command, environment()).out, "") << words;
  }
}

TEST_F(StudioTest, AWorkerThatIsATaskTellsWhatItDoes) {
  BackgroundProcess worker(
      {program("lightmill-worker"), "--server", server(), "--threads", "1", "--openjd", "--log-level", "info"},
      file("task.log"));
  ASSERT_TRUE(server_said("is here: 1 thread"));
  worker.send(SIGTERM);
  EXPECT_EQ(worker.wait(std::chrono::seconds(20)), 0);
  std::ifstream log(file("task.log"));
  const Told told = read_openjd(std::string(std::istreambuf_iterator<char>(log), {}));
  const auto says = [&](const std::string& part) {
    return std::ranges::any_of(told.status,
                               [&](const std::string& text) { return text.find(part) != std::string::npos; });
  };
  EXPECT_TRUE(says("connected to " + server()));
  EXPECT_TRUE(says("leaving"));
  EXPECT_TRUE(told.fail.empty());
}

// ---- tev ----

/// Listens as tev does, and reads packets as its documentation has them.
class Viewer {
 public:
  /// Port 0 takes a free one.
  explicit Viewer(std::uint16_t port = 0) : listening_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    const int yes = 1;
    ::setsockopt(listening_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listening_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listening_, 1), 0);
    socklen_t length = sizeof address;
    ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &length);
    port_ = ntohs(address.sin_port);
  }
  ~Viewer() {
    if (thread_.joinable()) {
      thread_.join();
    }
    ::close(listening_);
  }
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;
  std::string address() const { return fmt::format("127.0.0.1:{}", port_); }
  std::uint16_t port() const { return port_; }

  /// Takes one connection to its end. `pause`: before it reads, and then 1,000 bytes at a time.
  void start(std::chrono::milliseconds pause = {}) {
    thread_ = std::thread([this, pause] {
      const int connection = ::accept(listening_, nullptr, nullptr);
      std::this_thread::sleep_for(pause);
      std::vector<char> piece(pause.count() > 0 ? 1000 : 65536);
      for (ssize_t read = 0; (read = ::read(connection, piece.data(), piece.size())) > 0;) {
        bytes_.append(piece.data(), static_cast<std::size_t>(read));
      }
      ::close(connection);
    });
  }
  void join() { thread_.join(); }

  struct Image {
    int width = 0, height = 0;
    std::vector<float> planes;
    int updates = 0;
  };
  /// All images by name, as they are after all packets.
  std::map<std::string, Image> images() {
    std::map<std::string, Image> images;
    at_ = 0;
    while (at_ < bytes_.size()) {
      const std::size_t end = at_ + take<std::uint32_t>();
      const auto type = take<std::int8_t>();
      take<std::int8_t>();  // whether it grabs the focus
      const std::string name = text();
      if (type == 4) {
        Image image;
        image.width = take<std::int32_t>();
        image.height = take<std::int32_t>();
        channels();
        image.planes.resize(3 * static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
        images[name] = image;
      } else {
        EXPECT_EQ(type, 6);
        update(images.at(name));
      }
      EXPECT_EQ(at_, end);
    }
    return images;
  }

 private:
  template <class T>
  T take() {
    T value{};
    EXPECT_LE(at_ + sizeof value, bytes_.size());
    std::memcpy(&value, bytes_.data() + at_, sizeof value);
    at_ += sizeof value;
    return value;
  }
  std::string text() {
    const std::string read(bytes_.c_str() + at_);
    at_ += read.size() + 1;
    return read;
  }
  void channels() {
    EXPECT_EQ(take<std::int32_t>(), 3);
    for (const char* const name : {"R", "G", "B"}) {
      EXPECT_EQ(text(), name);
    }
  }
  void update(Image& image) {
    channels();
    const auto x = take<std::int32_t>(), y = take<std::int32_t>(), width = take<std::int32_t>(),
               height = take<std::int32_t>();
    ASSERT_TRUE(x >= 0 && y >= 0 && x + width <= image.width && y + height <= image.height);
    std::array<std::int64_t, 3> offsets{}, strides{};
    for (std::int64_t& offset : offsets) {
      offset = take<std::int64_t>();
    }
    for (std::int64_t& stride : strides) {
      stride = take<std::int64_t>();
    }
    std::int64_t most = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      most = std::max(most, offsets[c] + strides[c] * (std::int64_t{width} * height - 1));
    }
    std::vector<float> data(static_cast<std::size_t>(most) + 1);
    std::memcpy(data.data(), bytes_.data() + at_, data.size() * sizeof(float));
    at_ += data.size() * sizeof(float);
    for (int c = 0; c < 3; ++c) {
      for (int row = 0; row < height; ++row) {
        for (int column = 0; column < width; ++column) {
          const auto from = static_cast<std::size_t>(offsets[static_cast<std::size_t>(c)] +
                                                     strides[static_cast<std::size_t>(c)] * (row * width + column));
          const auto to = static_cast<std::size_t>((c * image.height + y + row) * image.width + x + column);
          image.planes[to] = data[from];
        }
      }
    }
    ++image.updates;
  }

  int listening_;
  std::uint16_t port_ = 0;
  std::string bytes_;
  std::size_t at_ = 0;
  std::thread thread_;
};

/// Whether the viewer has the pixels of the file.
void expect_picture(Viewer& viewer, const std::string& name, const std::string& exr) {
  const auto images = viewer.images();
  ASSERT_EQ(images.size(), 1u);
  ASSERT_TRUE(images.contains(name)) << images.begin()->first;
  const Viewer::Image& shown = images.at(name);
  const Result<RgbImage> file = load_rgb(exr);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(shown.width, file->width);
  EXPECT_EQ(shown.height, file->height);
  ASSERT_EQ(shown.planes.size(), file->values.size());
  // A mean is a sum over a count in the one and a sum times one over it in the other: they round once more.
  for (std::size_t i = 0; i < shown.planes.size(); ++i) {
    ASSERT_NEAR(shown.planes[i], file->values[i], std::ldexp(std::abs(file->values[i]), -22)) << i;
  }
}

TEST_F(StudioTest, AViewerShowsThePictureThatIsRendered) {
  Viewer viewer;
  viewer.start();
  start_worker("w");
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmall));
  on_farm({"watch", job, "--tev", viewer.address(), "-o", file("a.exr")});
  viewer.join();
  expect_picture(viewer, "job " + job + " cornell-bench-blocks", file("a.exr"));
}

TEST_F(StudioTest, ASlowViewerOfAPartOfThePictureGetsAllOfIt) {
  Viewer viewer;
  viewer.start(std::chrono::milliseconds(300));
  start_worker("w");
  const std::string job = submit(with({scene("cornell-bench-blocks.json"), "--crop", "10,5,70,60"}, kSmall));
  on_farm({"watch", job, "--tev", viewer.address(), "-o", file("a.exr")});
  viewer.join();
  expect_picture(viewer, "job " + job + " cornell-bench-blocks", file("a.exr"));
}

TEST_F(StudioTest, AViewerThatStartsLaterIsFound) {
  const std::uint16_t port = Viewer().port();
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmall));
  const std::string address = fmt::format("127.0.0.1:{}", port);
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
  Viewer viewer(port);
  viewer.start();
  ASSERT_TRUE(said("the picture goes to the viewer at " + address));
  start_worker("w");
  EXPECT_EQ(watch.wait(std::chrono::seconds(60)), 0);
  viewer.join();
  expect_picture(viewer, "job " + job + " cornell-bench-blocks", file("a.exr"));
}

TEST_F(StudioTest, WithoutAViewerAJobIsFollowedAllTheSame) {
  start_worker("w");
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmall));
  const std::string address = fmt::format("127.0.0.1:{}", Viewer().port());
  const CommandResult run = lightmill({"watch", job, "--tev", address, "-o", file("a.exr"), "--server", server()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.err.find("start tev or HDRView there"), std::string::npos) << run.err;
  EXPECT_NE(lightmill({"watch", job, "--tev", "nonsense", "--server", server()}).exit_code, 0);
}

TEST_F(StudioTest, WithoutAValueTheViewerIsWhereViewersListen) {
  const std::string job = submit(with({scene("cornell-bench-blocks.json")}, kSmall));
  start_worker("w");
  ASSERT_EQ(on_farm({"watch", job})["state"], "done");
  // Whether there is one or not, its address is said.
  for (const std::vector<std::string>& words : {std::vector<std::string>{"watch", job, "--tev"},
                                                {"watch", "--tev", job},
                                                {"watch", job, "--tev", "-o", file("a.exr")}}) {
    const CommandResult run = lightmill(with(words, {"--server", server()}));
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_NE(run.err.find("127.0.0.1:14158"), std::string::npos) << run.err;
  }
  EXPECT_TRUE(std::filesystem::exists(file("a.exr")));
  EXPECT_EQ(lightmill({"watch", job, "--server", server()}).err.find("14158"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test

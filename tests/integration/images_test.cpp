// Untrusted images: an image named by a scene makes no program open a file or an address.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fstream>

#include "common/base/file.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "tests/support/farm.h"
#include "tests/support/image_files.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

/// A web server on loopback that must get no requests.
class Listener {
 public:
  Listener() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
    EXPECT_EQ(::listen(socket_, 8), 0);
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
  }
  ~Listener() { ::close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  std::string url(const std::string& path) const { return fmt::format("http://127.0.0.1:{}/{}", port_, path); }
  /// Whether a client has connected. Closes the connection, so that the client does not wait.
  bool asked() {
    const int connection = ::accept4(socket_, nullptr, nullptr, SOCK_NONBLOCK);
    if (connection >= 0) {
      ::close(connection);
    }
    asked_ = asked_ || connection >= 0;
    return asked_;
  }

 private:
  const int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  int port_ = 0;
  bool asked_ = false;
};

/// The child processes of a process.
std::vector<pid_t> children_of(pid_t parent) {
  std::vector<pid_t> children;
  for (const auto& task : std::filesystem::directory_iterator(fmt::format("/proc/{}/task", parent))) {
    std::ifstream list(task.path() / "children");
    for (pid_t child = 0; list >> child;) {
      children.push_back(child);
    }
  }
  return children;
}

/// Private files of a machine, and uploaded images that name them.
class Images : public ::testing::Test {
 protected:
  void SetUp() override {
    farm_.add_worker(1, "w1");
    ASSERT_TRUE(eventually([&] { return farm_.met("w1"); }));
  }
  std::string secret(const std::string& format, const std::string& bytes) const {
    const std::filesystem::path path = farm_.folder() / ("secret." + format);
    std::ofstream(path, std::ios::binary) << bytes;
    return path.string();
  }
  std::vector<std::string> attacks(const Listener& listener) const {
    std::vector<std::string> names{secret("dcm", std::string(128, '\0') + "DICM"),
                                   "x.null",
                                   "any.null",
                                   listener.url("x.mp4"),
                                   listener.url("x.avi"),
                                   "concat:/etc/hostname|x.mp4"};
    for (const char* format : {"sgi", "fits", "rla", "ico"}) {
      names.push_back(secret(format, image_file(format, 0.75f)));
    }
    return names;
  }
  /// A job with an image of that name and these bytes.
  v1::Job rendered(const std::string& name, const std::string& bytes) {
    FarmClient client = farm_.client();
    LoadedScene loaded = shipped_scene("course-default");
    loaded.scene.film.width = loaded.scene.film.height = 32;
    loaded.scene.textures.at(0).file = name;
    loaded.scene.textures.at(0).asset = sha256(bytes);
    loaded.assets = {{sha256(bytes), bytes}};
    client.upload_assets(loaded);
    JobSpec spec = job_of({.side = 32, .samples = 2, .scene = "course-default"}, fmt::format("job {}", ++jobs_));
    spec.settings.scene = pack_scene(loaded.scene);
    spec.settings.assets = {sha256(bytes)};
    v1::SubmitJobRequest request;
    to_wire(spec, &request);
    grpc::ClientContext context;
    v1::Job job;
    const grpc::Status status = client.stub().SubmitJob(&context, request, &job);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return client.wait_until_ended(job.id());
  }
  grpc::Status inspected(const std::string& name, const std::string& bytes) {
    v1::InspectSceneRequest request;
    const std::string document = fmt::format(
        R"({{"camera": {{"eye": [0, 0, 5], "look_at": [0, 0, 0], "camera_constant": 1}},
"textures": [{{"name": "t", "file": "{}"}}],
"materials": [{{"name": "m", "diffuse": {{"reflectance": {{"texture": "t", "rgb": [1, 1, 1]}}}}}}],
"objects": [{{"material": "m", "sphere": {{"center": [0, 0, 0], "radius": 1}}}}]}})",
        name);
    LoadedScene assets;
    for (const auto& [path, text] :
         std::vector<std::pair<std::string, std::string>>{{"a.json", document}, {name, bytes}}) {
      assets.assets[sha256(text)] = text;
      v1::InspectSceneRequest::File* file = request.add_files();
      file->set_path(path);
      file->set_digest(digest_bytes(sha256(text)));
    }
    farm_.client().upload_assets(assets);
    request.add_scene("a.json");
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTimeout);
    v1::InspectSceneResponse response;
    return farm_.client().stub().InspectScene(&context, request, &response);
  }

  Farm farm_;
  int jobs_ = 0;
};

TEST_F(Images, NamesOfFilesAndAddressesAreNotOpenedByAWorkerThatRenders) {
  Listener listener;
  for (const std::string& name : attacks(listener)) {
    const v1::Job job = rendered(name, "junk");
    EXPECT_EQ(job.state(), v1::JOB_STATE_FAILED) << name;
    EXPECT_NE(job.reason().find(name + ": not a readable image: its first bytes match none of the formats"),
              std::string::npos)
        << job.reason();
  }
  EXPECT_FALSE(listener.asked());
}

TEST_F(Images, NamesOfFilesAndAddressesAreNotOpenedByInspectScene) {
  // Names are relative to the worker's folder. This test's files are in it.
  Listener listener;
  std::vector<std::string> names{"x.null", listener.url("x.mp4")};
  std::vector<std::string> files;
  for (const char* format : {"sgi", "fits", "rla", "ico"}) {
    files.push_back(fmt::format("lightmill-secret-{}.{}", ::getpid(), format));
    std::ofstream(files.back(), std::ios::binary) << image_file(format, 0.75f);
  }
  names.insert(names.end(), files.begin(), files.end());
  for (const std::string& name : names) {
    const grpc::Status status = inspected(name, "junk");
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << name;
    EXPECT_NE(status.error_message().find("not a readable image: its first bytes match none of the formats"),
              std::string::npos)
        << name << " " << status.error_message();
  }
  EXPECT_FALSE(listener.asked());
  for (const std::string& file : files) {
    std::filesystem::remove(file);
  }
}

TEST_F(Images, AFarmRendersJustTheFormatsThatCheckAccepts) {
  const TemporaryFolder folder;
  std::vector<ImageFile> files;
  for (ImageFile& file : readable_image_files()) {
    if (files.empty() || files.back().format != file.format) {  // one of each is enough here
      files.push_back(std::move(file));
    }
  }
  const std::vector<ImageFile> refused = refused_image_files();
  files.insert(files.end(), refused.begin(), refused.end());
  int accepted = 0;
  for (const ImageFile& file : files) {
    if (file.bytes.empty()) {
      continue;  // a farm accepts no empty asset
    }
    const std::string name = "image." + file.format;
    std::ofstream(folder.path() / name, std::ios::binary) << file.bytes;
    std::string document = read_file(source_file("scenes/course-default.json")).value();
    document.replace(document.find("assets/tiles.png"), std::string("assets/tiles.png").size(), name);
    const std::filesystem::path scene = folder.path() / "scene.json";
    std::ofstream(scene) << document;
    const CommandResult check = run_command({program("lightmill"), "check", scene.string()}, {});
    const v1::Job job = rendered(name, file.bytes);
    EXPECT_EQ(check.exit_code == 0, job.state() == v1::JOB_STATE_DONE) << name << " " << check.err << job.reason();
    EXPECT_EQ(check.exit_code == 0, inspected(name, file.bytes).ok()) << name;
    accepted += check.exit_code == 0 ? 1 : 0;
  }
  EXPECT_EQ(accepted, static_cast<int>(files.size() - refused.size()));
}

TEST_F(Images, AWorkerWhoseDecoderIsKilledDecodesTheNextImage) {
  const std::string png = image_file("png", 0.5f);
  ASSERT_EQ(rendered("a.png", png).state(), v1::JOB_STATE_DONE);
  const std::vector<pid_t> decoders = children_of(farm_.worker("w1").pid());
  ASSERT_EQ(decoders.size(), 1u);
  ASSERT_EQ(::kill(decoders[0], SIGKILL), 0);
  EXPECT_EQ(rendered("b.png", image_file("png", 0.25f)).state(), v1::JOB_STATE_DONE);
}

TEST_F(Images, ADecoderEndsWithItsWorker) {
  ASSERT_EQ(rendered("a.png", image_file("png", 0.5f)).state(), v1::JOB_STATE_DONE);
  const std::vector<pid_t> decoders = children_of(farm_.worker("w1").pid());
  ASSERT_EQ(decoders.size(), 1u);
  kill_at_once(farm_.worker("w1"));
  EXPECT_TRUE(eventually([&] { return ::kill(decoders[0], 0) != 0; }));
}

}  // namespace
}  // namespace lightmill::test

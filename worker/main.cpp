// lightmill-worker: renders for a farm.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <latch>
#include <system_error>
#include <thread>
#include <vector>

#include "common/base/address.h"
#include "common/base/digest.h"
#include "common/base/log.h"
#include "common/base/machine_memory.h"
#include "common/base/number_text.h"
#include "common/base/openjd.h"
#include "common/base/out_of_memory.h"
#include "common/base/signals.h"
#include "common/base/text.h"
#include "common/command_line/daemon_options.h"
#include "common/command_line/describe_option.h"
#include "common/farm/job.h"
#include "common/security/caller_options.h"
#include "worker/inspect/scene_reader.h"
#include "worker/render/scene_limits.h"
#include "worker/render/worker_class.h"
#include "worker/shell/worker_loop.h"
#include "worker/state/state_folder.h"

namespace lightmill {
namespace {

constexpr const char* kServerVariable = "LIGHTMILL_SERVER";
constexpr const char* kEnrolFileVariable = "LIGHTMILL_ENROL_FILE";
constexpr const char* kStateVariable = "LIGHTMILL_STATE";
/// Threads of this program and its libraries (mostly gRPC), without those that render.
constexpr std::uint32_t kOtherThreads = 16;

/// Starts `count` threads at once, and ends them: libraries abort if they cannot start theirs. RESOURCE_EXHAUSTED if
/// one cannot start.
Status check_threads(std::uint32_t count) {
  std::latch all(1);
  std::vector<std::jthread> threads;
  Status status;
  try {
    for (std::uint32_t i = 0; i < count; ++i) {
      threads.emplace_back([&] { all.wait(); });
    }
  } catch (const std::system_error& error) {
    status = resource_exhausted(
        "only {} of the {} threads that this worker needs can start ({}): run it with fewer --threads, or raise the "
        "limit of its tasks (ulimit -u, pids.max, TasksMax) or of its memory (ulimit -v)",
        threads.size(), count, error.what());
  }
  all.count_down();
  return status;
}

struct Options {
  std::string server = "127.0.0.1:7350";
  std::vector<std::string> servers;  ///< parts of `server`
  CallerFiles caller;
  std::string enrol_file;  ///< empty: the worker does not enrol
  std::string state;       ///< empty: default_state_root
  std::uint32_t threads = std::max(1u, std::thread::hardware_concurrency());
  std::string name;
  LogOptions log;
  std::size_t scenes = 8;
  double scenes_gib = 4;
  double scene_gib = share_of_memory_gib(0.75, 65536);
  std::uint64_t scene_triangles = SceneLimits().triangles;
  double image_megapixels = static_cast<double>(SceneLimits().image_pixels) / (1 << 20);
  double images_gib = static_cast<double>(SceneLimits().images_bytes) / (1 << 30);
  double scene_seconds = SceneLimits().seconds;
  double assets_gib = 1;
  double results_mib = 256;
  bool unsandboxed_images = false;
  bool openjd = false;
};

/// Identifies this machine until its next boot, equally in all its containers. Without a boot id it is the host's name.
std::string machine_name() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  return std::getline(file, id) && !id.empty() ? sha256("lightmill machine " + id).hex().substr(0, 12) : host_name();
}

/// Checks that need more than one option. Fills in missing values.
Status check_options(Options& options) {
  options.servers = CLI::detail::split(options.server, ',');
  for (const std::string& server : options.servers) {
    if (const Result<HostPort> address = parse_host_port(server); !address.ok() || address->port == 0) {
      const char* const variable = std::getenv(kServerVariable);
      return invalid_argument(
          "{}: {}", variable != nullptr && options.server == variable ? kServerVariable : "--server",
          address.ok() ? fmt::format("the port of '{}' must not be 0", server) : message_of(address.status()));
    }
  }
  LM_ASSIGN_OR_RETURN(const CallerTexts caller,
                      read_caller(options.caller, options.servers, system_clock().unix_milliseconds() / 1000));
  if (!options.enrol_file.empty() && !caller.token.empty()) {
    return invalid_argument("{} and a token ({} or {}) are both given: give only one", kEnrolFileOption,
                            kTokenFileOption, kTokenVariable);
  }
  if (options.name.empty()) {  // with enrolment, the token's name has the host
    options.name =
        options.enrol_file.empty() ? fmt::format("{}-{}", host_name(), ::getpid()) : std::to_string(::getpid());
  }
  return check_name("--name", options.name);
}

/// Reports to a farm manager (Open Job Description) why the worker cannot start or continue.
class FailureReport {
 public:
  FailureReport(int argc, char** argv) : wanted_(has_flag(argc, argv, "--openjd")) {}
  void operator()(const std::string& why) const {
    if (wanted_) {
      std::cout << openjd_fail(why) << std::endl;
    }
  }

 private:
  bool wanted_;
};

/// An exit code, or nothing if the worker should run.
std::optional<int> parse(int argc, char** argv, const FailureReport& failed, Options& options) {
  CLI::App app{
      "A worker of a Lightmill farm: connects to a `lightmill-server` and renders the units that it gets.\n\nStart "
      "any number of workers on any number of machines, at any time.\nAfter Ctrl-C or SIGTERM, a worker finishes "
      "what it has begun, gives back the rest and leaves. A second signal ends it at once.\n",
      "lightmill-worker"};
  app.footer(
      "Exit codes: 0 it has left the farm, 1 it cannot start or continue, 2 bad usage, 130 stopped at once.\n\nExamples:\n"
      "  lightmill-worker --server 127.0.0.1:7350\n"
      "  lightmill-worker --server farm.example:7350 --tls-ca ca.pem --enrol-file render.enrol");
  app.set_help_flag("-h,--help", "print this help");
  app.set_version_flag("--version", fmt::format("lightmill-worker {} ({})", LIGHTMILL_VERSION, kRendererVersion),
                       "print the version");
  add_describe_option(app, LIGHTMILL_VERSION);
  app.add_option("--server", options.server,
                 "HOST:PORT of the coordinator. Several, separated by commas, are tried in turn")
      ->type_name("HOST:PORT[,HOST:PORT]")
      ->envname(kServerVariable)
      ->capture_default_str();
  add_limit(app, "--threads", options.threads, "N", {1, 4096}, "rendering threads")
      ->default_str("one for each processor core")
      ->group("Options");
  app.add_option("--name", options.name, "the worker's name, unique in the farm")
      ->type_name("NAME")
      ->default_str("HOST-PID; with --enrol-file: PID");
  add_caller_options(app, options.caller);
  app.add_option(
         kEnrolFileOption, options.enrol_file,
         "an enrolment token (`lightmill tokens create NAME --enrol N`). With it, the worker gets a token of its "
         "own. It keeps that in --state, and uses it from then on")
      ->type_name("FILE")
      ->envname(kEnrolFileVariable)
      ->group("Access");
  app.add_option("--state", options.state,
                 "folder of the token from --enrol-file. Workers that share it have one subfolder each. If "
                 "XDG_STATE_HOME is set, the default is $XDG_STATE_HOME/lightmill-worker")
      ->type_name("DIR")
      ->envname(kStateVariable)
      ->default_str("~/.local/state/lightmill-worker")
      ->group("Access");
  add_log_options(app, options.log);
  add_limit(app, "--scenes", options.scenes, "N", {1, 10'000}, "compiled scenes that are kept");
  add_limit(app, "--scenes-gib", options.scenes_gib, "GIB", {0.001, 65536.0}, "memory for compiled scenes");
  add_limit(app, "--scene-gib", options.scene_gib, "GIB", {0.001, 65536.0},
            "estimated memory of one scene while it is compiled. Scenes beyond this, --scene-triangles, "
            "--image-megapixels, --images-gib or --scene-seconds are left to other workers")
      ->default_str("three quarters of the memory that the worker may use");
  add_limit(app, "--scene-triangles", options.scene_triangles, "N", {1, kMaxSceneTriangles},
            "triangles of one scene. Instances of a mesh count once")
      ->default_str("200 million");
  add_limit(app, "--image-megapixels", options.image_megapixels, "N", {0.001, 256.0},
            "size of one decoded image, in units of 1,048,576 pixels");
  add_limit(app, "--images-gib", options.images_gib, "GIB", {0.001, 65536.0}, "all decoded images of one scene");
  add_limit(app, "--scene-seconds", options.scene_seconds, "SECONDS", {1.0, 1e6},
            "time to prepare one scene, without the download of its files. Scenes that take longer are left to other "
            "workers");
  add_limit(app, "--assets-gib", options.assets_gib, "GIB", {0.0, 65536.0}, "memory for downloaded assets");
  add_limit(app, "--results-mib", options.results_mib, "MIB", {1.0, 1e6},
            "memory for unacknowledged results. Beyond it, rendering pauses");
  app.add_flag(
      kUnsandboxedImages, options.unsandboxed_images,
      "decode images and compressed meshes even if the kernel refuses the sandbox (seccomp). Only for farms whose "
      "users you trust");
  app.add_flag(
      "--openjd", options.openjd,
      "also print messages of Open Job Description (openjd_status, openjd_fail) on standard output, for a farm "
      "manager that runs the worker as a task");
  return parse_options(
      app, argc, argv, [&] { return check_options(options); }, failed);
}

/// State folder of a worker that enrols. Checks that it has a token, or an enrolment token to get one.
Result<StateFolder> take_state(const Options& options) {
  std::filesystem::path root = options.state;
  if (root.empty()) {
    LM_ASSIGN_OR_RETURN(root, default_state_root());
  }
  LM_ASSIGN_OR_RETURN(StateFolder state, StateFolder::take(root));
  if (!state.has_token()) {
    const CallerFiles files{options.caller.tls, options.enrol_file, kEnrolFileOption};
    const Status readable = read_caller(files, options.servers, system_clock().unix_milliseconds() / 1000).status();
    if (!readable.ok()) {
      const bool exists = std::filesystem::exists(options.enrol_file);
      return make_error(readable.code(), "this worker has no token in {} yet: {}{}", state.path().string(),
                        message_of(readable),
                        exists ? ""
                               : ". Make an enrolment token with `lightmill tokens create NAME --enrol N --out FILE`, "
                                 "and give it with --enrol-file FILE");
    }
  }
  return state;
}

WorkerOptions worker_options(const Options& options, StateFolder* state) {
  WorkerOptions worker;
  worker.farm = {options.servers, options.caller};
  if (state != nullptr) {
    worker.farm.enrolment = {options.enrol_file, state, host_name()};
  }
  worker.scenes = {options.scenes, bytes_of_gib(options.scenes_gib)};
  worker.scene = {bytes_of_gib(options.scene_gib), options.scene_triangles,
                  static_cast<std::int64_t>(options.image_megapixels * (1 << 20)), bytes_of_gib(options.images_gib),
                  options.scene_seconds};
  worker.decoder.unsandboxed = options.unsandboxed_images;
  worker.reader = "/proc/self/exe";  // this build, also if another one was installed meanwhile
  worker.asset_bytes = bytes_of_gib(options.assets_gib);
  worker.session.name = options.name;
  worker.session.host = host_name();
  worker.session.machine = machine_name();
  worker.session.pid = static_cast<std::uint32_t>(::getpid());
  worker.session.threads = options.threads;
  worker.session.fingerprint_class = worker_class(worker.decoder.program);
  worker.session.renderer_version = kRendererVersion;
  worker.connected = stay_within_group_memory;
  worker.session.unacknowledged_bytes = bytes_of_gib(options.results_mib / 1024);
  return worker;
}

/// Passes signals to the loop, once it exists.
class SignalTarget {
 public:
  void signal(int count) {
    if (count > 1) {
      std::_Exit(130);
    }
    const MutexLock lock(mutex_);
    signalled_ = true;
    if (loop_ != nullptr) {
      loop_->drain();
    }
  }
  void set(WorkerLoop* loop) {
    const MutexLock lock(mutex_);
    loop_ = loop;
    if (signalled_ && loop != nullptr) {
      loop->drain();
    }
  }

 private:
  Mutex mutex_;
  WorkerLoop* loop_ LM_GUARDED_BY(mutex_) = nullptr;
  bool signalled_ LM_GUARDED_BY(mutex_) = false;
};

/// Runs until the worker has left. RESOURCE_EXHAUSTED if memory or threads run out and no job is the cause.
Status work(const Options& options, StateFolder* state, SignalTarget& target) {
  spdlog::info("worker {} starts: it renders a test picture to find its fingerprint class", options.name);
  const WorkerOptions worker = worker_options(options, state);
  spdlog::info("worker {}: {}, fingerprint class {}", options.name, counted(options.threads, "thread"),
               worker.session.fingerprint_class);
  // Directly before the libraries start their threads, because gRPC hangs if it cannot start one.
  LM_RETURN_IF_ERROR(check_threads(options.threads + kOtherThreads));
  WorkerLoop loop(worker, system_clock());
  const std::unique_ptr<SignalTarget, void (*)(SignalTarget*)> until_end(&target,
                                                                         [](SignalTarget* end) { end->set(nullptr); });
  target.set(&loop);
  return loop.run();
}

int run(int argc, char** argv) {
  SignalTarget target;
  const StopSignals signals([&target](int count) { target.signal(count); });
  const FailureReport failed(argc, argv);
  Options options;
  if (const std::optional<int> code = parse(argc, argv, failed, options)) {
    return *code;
  }
  if (const Status status = start_logging("lightmill-worker", options.log.level, options.log.format); !status.ok()) {
    std::cerr << "lightmill-worker: " << message_of(status) << "\n";
    failed(message_of(status));
    return 2;
  }
  if (options.openjd) {
    log_as_openjd_status();
  }
  std::optional<StateFolder> state;
  if (!options.enrol_file.empty()) {
    Result<StateFolder> taken = take_state(options);
    if (!taken.ok()) {
      spdlog::error("{}", message_of(taken.status()));
      failed(message_of(taken.status()));
      return 1;
    }
    state = *std::move(taken);
  }
  if (options.unsandboxed_images) {
    spdlog::warn(
        "images and compressed meshes are decoded without a sandbox if the kernel refuses it ({}): a malicious one may "
        "take over this worker",
        kUnsandboxedImages);
  }
  const Status status =
      within_limits("this worker ran", [&] { return work(options, state ? &*state : nullptr, target); });
  if (!status.ok()) {
    spdlog::error("{}", message_of(status));
    failed(message_of(status));
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  if (argc == 2 && std::string_view(argv[1]) == lightmill::kSceneReaderOption) {
    return lightmill::run_scene_reader();
  }
  lightmill::exit_on_out_of_memory("lightmill-worker", 1, lightmill::has_flag(argc, argv, "--openjd"));
  return lightmill::run(argc, argv);
}

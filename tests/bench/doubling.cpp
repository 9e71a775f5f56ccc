// Speedup of two workers with one thread each over one. They are real processes on the cores of this machine.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/base/check.h"
#include "tests/bench/measure.h"
#include "tests/support/farm.h"

namespace {

using namespace lightmill;

struct Options {
  int side = 512, turns = 5;
  std::uint64_t samples = 1024;
};

struct Turn {
  double seconds = 0;         ///< from submission to done
  double thread_seconds = 0;  ///< of rendering, over all workers
};

Turn render(test::FarmClient& client, const Options& options, std::uint64_t seed) {
  test::Picture picture;
  picture.side = options.side;
  picture.samples = options.samples;
  picture.seed = seed;
  const v1::Job job =
      client.wait_until_ended(client.submit(picture, fmt::format("doubling-{}", seed)).id(), std::chrono::minutes(30));
  LM_CHECK(job.state() == v1::JOB_STATE_DONE, "job: {}", job.ShortDebugString());
  return {static_cast<double>(job.finished_unix_ms() - job.submitted_unix_ms()) / 1000, job.worker_seconds()};
}

int run(const Options& options) {
  test::Farm farm({"--log-level", "warn"});
  test::FarmClient client = farm.client();
  client.upload_assets();
  std::uint64_t seed = 0;
  Options small = options;
  small.samples = 16;
  std::vector<double> gains, costs;
  fmt::print("| turn | one worker, s | two, s | speedup | thread seconds of two / one |\n");
  fmt::print("| --- | --- | --- | --- | --- |\n");
  for (int turn = 0; turn < options.turns; ++turn) {
    const std::string first = fmt::format("a{}", turn), second = fmt::format("b{}", turn);
    farm.add_worker(1, first);
    render(client, small, ++seed);  // loads the scene
    const Turn one = render(client, options, ++seed);
    farm.add_worker(1, second);
    render(client, small, ++seed);
    const Turn two = render(client, options, ++seed);
    gains.push_back(one.seconds / two.seconds);
    costs.push_back(two.thread_seconds / one.thread_seconds);
    fmt::print("| {} | {:.2f} | {:.2f} | {:.3f} | {:.3f} |\n", turn + 1, one.seconds, two.seconds, gains.back(),
               costs.back());
    std::fflush(stdout);
    for (const std::string& name : {first, second}) {
      farm.worker(name).send(SIGTERM);
      LM_CHECK(farm.worker(name).wait(std::chrono::seconds(30)), "{} does not leave", name);
    }
  }
  fmt::print("| median | | | {:.3f} | {:.3f} |\n", median(gains), median(costs));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Speedup of two workers with one thread each over one, on this machine's cores.");
  Options options;
  app.add_option("--side", options.side, "width and height of the picture in pixels")
      ->capture_default_str()
      ->check(CLI::Range(64, 8192));
  app.add_option("--spp", options.samples, "samples per pixel")->capture_default_str()->check(CLI::Range(16, 1 << 20));
  app.add_option("--turns", options.turns, "measurements with one worker and with two")
      ->capture_default_str()
      ->check(CLI::Range(1, 100));
  CLI11_PARSE(app, argc, argv);
  return run(options);
}

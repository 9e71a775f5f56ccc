#include "tests/bench/soak/soak_jobs.h"

#include <fmt/format.h>

#include <algorithm>

#include "client/cli/film_fetch.h"
#include "client/cli/progress.h"
#include "tests/support/paths.h"
#include "tests/support/process.h"

namespace lightmill::soak {
namespace {

constexpr std::size_t kMaxListed = 1000;
constexpr std::uint64_t kCommandOnceIn = 100;  // a job gets a command once in this many steps

/// Words separated by spaces. The first one is the scene.
std::vector<std::string> words_of(const Kind& kind, int samples) {
  std::vector<std::string> words;
  const std::string all = kind.words;
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t end = std::min(all.find(' ', at), all.size());
    words.push_back(all.substr(at, end - at));
    at = end + 1;
  }
  words[0] = test::source_file(words[0]);
  if (samples > 0) {
    words.insert(words.end(), {"--spp", std::to_string(samples)});
  }
  return words;
}

}  // namespace

const std::vector<Kind>& kinds() {
  static const std::vector<Kind> all{
      {"blocks", "scenes/cornell-bench-blocks.json --method path --size 128x128", 640, true},
      {"blocks with layers",
       "scenes/cornell-bench-blocks.json --method path --size 128x96 --layers direct,indirect,albedo,normal,depth,id",
       256},
      {"blocks to an error", "scenes/cornell-bench-blocks.json --method path --size 128x128 --error 0.002"},
      {"blocks, adaptive", "scenes/cornell-bench-blocks.json --method path --size 192x192 --adaptive", 128},
      {"part of the blocks", "scenes/cornell-bench-blocks.json --method path --crop 100,120,150,90", 256, true},
      {"blocks, all audited", "scenes/cornell-bench-blocks.json --method path --size 128x128 --audit all", 256},
      {"course blocks by auto", "scenes/cornell-course-blocks.json --size 128x128", 384, true},
      {"balls by auto", "scenes/cornell-bench-balls.json --size 128x128", 192, true},
      {"balls by caustic", "scenes/cornell-bench-balls.json --method caustic --size 128x128 --seed 3", 192, true},
      {"balls by vcm", "scenes/cornell-bench-balls.json --method vcm --size 96x96", 96},
      {"balls by ppm", "scenes/cornell-bench-balls.json --method ppm --size 96x96", 96},
      {"balls to an error", "scenes/cornell-bench-balls.json --method caustic --size 128x128 --error 0.01"},
      {"course balls by whitted", "scenes/cornell-course-balls.json --method whitted --size 192x192", 512},
      {"absorbing glass by auto", "scenes/cornell-absorbing-glass.json --size 96x96", 192},
      {"small lamp", "scenes/cornell-bench-small-lamp.json --method caustic --size 128x128", 128, true},
      {"course scene with its texture", "scenes/course-default.json --size 160x160", 128},
      {"rough gold, adaptive", "tests/bench/choices/sun-on-rough-gold.json --method path --size 160x120 --adaptive",
       128},
      {"meters", "tests/bench/soak/light-meters.json --method caustic", 128},
      {"photon map", "scenes/cornell-bench-balls.json --method photon-map --size 128x128", 64},
      {"ambient occlusion of the blocks", "scenes/cornell-bench-blocks.json --method ao --size 192x192", 512, true},
  };
  return all;
}

Jobs::Jobs(std::string address, Films quiet, std::uint64_t seed)
    : address_(std::move(address)), quiet_(std::move(quiet)), farm_(address_), random_(seed) {}

void Jobs::step() {
  const auto listed = farm_.list_jobs({}, kMaxListed);
  if (!listed.ok()) {
    return;  // the coordinator is away
  }
  none_left_ = ends_ && listed->items.empty();
  for (const Kind& kind : kinds()) {
    bool there = quiet() && films().contains(kind.name);
    for (const v1::Job& job : listed->items) {
      if (job.name() == kind.name) {
        there = true;
        look_at(job, kind);
      }
    }
    if (!there && !ends_) {
      submit(kind);
    }
  }
}

/// The next step sees the result.
void Jobs::submit(const Kind& kind) {
  std::vector<std::string> command{test::program("lightmill"), "submit"};
  const std::vector<std::string> words = words_of(kind, kind.grows && !quiet() ? kind.samples / 2 : kind.samples);
  command.insert(command.end(), words.begin(), words.end());
  command.insert(command.end(), {"--server", address_, "--name", kind.name});
  const test::CommandResult result = test::run_command(command);
  if (result.exit_code == cli::kBadInput) {
    say_wrong(fmt::format("'{}' was refused: {}", kind.name, result.err));
  }
}

void Jobs::look_at(const v1::Job& job, const Kind& kind) {
  if (job.state() == v1::JOB_STATE_FAILED || job.state() == v1::JOB_STATE_CANCELLED) {
    say_wrong(fmt::format("job {}, '{}', is {}: {}", job.id(), kind.name, cli::state_name(job.state()), job.reason()));
    (void)farm_.delete_job(job.id());
  } else if (job.state() == v1::JOB_STATE_PAUSED && (ends_ || random_() % 8 == 0)) {
    (void)farm_.resume_job(job.id());
  } else if (kind.grows && job.goal().samples() < static_cast<std::uint64_t>(kind.samples)) {
    if (job.state() == v1::JOB_STATE_DONE || random_() % kCommandOnceIn == 0) {
      if (farm_.extend_job(job.id(), static_cast<std::uint64_t>(kind.samples), 0).ok()) {
        count("extended");
      }
    }
  } else if (job.state() == v1::JOB_STATE_DONE) {
    compare(job);
  } else if (!quiet() && !ends_ && random_() % kCommandOnceIn == 0) {
    command(job);
  }
}

void Jobs::compare(const v1::Job& job) {
  const Result<AssembledFilm> film = cli::fetch_film(farm_, job.id());
  if (!film.ok()) {
    return;
  }
  const std::string& hash = film->picture.receipt.film_hash;
  if (!farm_.delete_job(job.id()).ok()) {
    return;  // the job is compared again
  }
  const MutexLock lock(mutex_);
  if (quiet()) {
    films_[job.name()] = hash;
  } else if (quiet_.at(job.name()) == hash) {
    ++tally_.alike;
  } else {
    tally_.wrong.push_back(fmt::format("the film of job {}, '{}', has hash {} instead of {}", job.id(), job.name(),
                                       hash, quiet_.at(job.name())));
  }
}

void Jobs::command(const v1::Job& job) {
  if (random_() % 2 == 0) {
    if (farm_.pause_job(job.id()).ok()) {
      count("paused");
    }
  } else if (farm_.set_priority(job.id(), static_cast<std::int32_t>(random_() % 3) - 1).ok()) {
    count("given another priority");
  }
}

void Jobs::count(const std::string& command) {
  const MutexLock lock(mutex_);
  ++tally_.commands[command];
}

void Jobs::say_wrong(std::string what) {
  const MutexLock lock(mutex_);
  tally_.wrong.push_back(std::move(what));
}

Tally Jobs::tally() const {
  const MutexLock lock(mutex_);
  return tally_;
}

Films Jobs::films() const {
  const MutexLock lock(mutex_);
  return films_;
}

}  // namespace lightmill::soak

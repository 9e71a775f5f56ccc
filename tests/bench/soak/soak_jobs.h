// The jobs of a soak: twenty kinds, always running on one farm. Their films are compared with those of a quiet farm.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "client/cli/coordinator_client.h"
#include "common/base/mutex.h"

namespace lightmill::soak {

struct Kind {
  const char* name;    ///< also that of its jobs
  const char* words;   ///< arguments of `lightmill submit`: the scene and options
  int samples = 0;     ///< per pixel; 0: the words have another goal
  bool grows = false;  ///< starts with half of them, and is extended
};

const std::vector<Kind>& kinds();

/// Film hashes by the name of the kind.
using Films = std::map<std::string, std::string>;

/// Results so far.
struct Tally {
  int alike = 0;                        ///< films that equal those of the quiet run
  std::map<std::string, int> commands;  ///< pauses, priorities, extensions, with their counts
  std::vector<std::string> wrong;       ///< descriptions of errors
};

/// Finds jobs by name, so a lost answer does not matter. Calls may fail, and a later step repeats them. Only step() is
/// not thread-safe.
class Jobs {
 public:
  /// Compares with `quiet`. If that is empty, keeps the films for comparison and gives no commands.
  Jobs(std::string address, Films quiet, std::uint64_t seed);

  /// Checks all jobs once. Compares and deletes done jobs, submits missing ones unless the soak ends, and sometimes
  /// pauses a job or changes its priority.
  void step();
  /// Submits no more jobs, and pauses none.
  void stop_submitting() { ends_ = true; }
  /// Whether no job is left after stop_submitting().
  bool none_left() const { return none_left_; }

  Tally tally() const;
  Films films() const;

 private:
  void submit(const Kind& kind);
  void look_at(const v1::Job& job, const Kind& kind);
  void compare(const v1::Job& job);
  void command(const v1::Job& job);
  void count(const std::string& command);
  void say_wrong(std::string what);
  bool quiet() const { return quiet_.empty(); }

  const std::string address_;
  const Films quiet_;
  cli::CoordinatorClient farm_;
  std::mt19937_64 random_;
  std::atomic<bool> ends_ = false, none_left_ = false;
  mutable Mutex mutex_;
  Tally tally_ LM_GUARDED_BY(mutex_);
  Films films_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill::soak

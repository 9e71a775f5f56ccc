// The jobs of a soak: twenty of different kinds, always under way on one farm, whose films are compared with quiet
// ones.
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "client/cli/farm_connection.h"
#include "common/base/mutex.h"

namespace lightmill::soak {

struct Kind {
  const char* name;    ///< also that of its jobs
  const char* words;   ///< what `lightmill submit` is told: the scene, and options
  int samples = 0;     ///< a pixel; 0: the words have another goal
  bool grows = false;  ///< begins with half of them, and is extended
};

const std::vector<Kind>& kinds();

/// Film hashes by the name of the kind.
using Films = std::map<std::string, std::string>;

/// What has become of the jobs so far.
struct Tally {
  int alike = 0;                        ///< films that were compared and are what the quiet run has
  std::map<std::string, int> commands;  ///< pauses, priorities, extensions: how often each
  std::vector<std::string> wrong;       ///< what must not be, each in words
};

/// Jobs are known by their names alone, so that it does not matter whether an answer was lost. Calls may fail: what was
/// to be done is done at a later step. Thread-safe but for step().
class Jobs {
 public:
  /// Compares with `quiet`; where that is empty, keeps the films for others to compare with, and gives no commands.
  Jobs(std::string address, Films quiet, std::uint64_t seed);

  /// Looks at all jobs once: compares and deletes those that are done, submits those that are missing unless it is to
  /// come to an end, and now and then pauses one, or changes its priority.
  void step();
  /// No more are submitted, and none is paused.
  void come_to_an_end() { ends_ = true; }
  /// Whether an end has come: no job is left.
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
  cli::FarmConnection farm_;
  std::mt19937_64 random_;
  std::atomic<bool> ends_ = false, none_left_ = false;
  mutable Mutex mutex_;
  Tally tally_ LM_GUARDED_BY(mutex_);
  Films films_ LM_GUARDED_BY(mutex_);
};

}  // namespace lightmill::soak

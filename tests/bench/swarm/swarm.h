// Thousands of workers in one process: each is a real session on a real connection of its own, and only its threads are
// made up. A tile takes as long as it would at a stated speed, and its node is a copy of one that was made and hashed
// before: what this process does is to copy nodes, and what gRPC does with them.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "common/base/mutex.h"

namespace lightmill::bench {

struct SwarmOptions {
  std::string server;  ///< HOST:PORT
  std::uint32_t workers = 100;
  std::uint32_t threads = 1;  ///< of each
  double speed = 1e6;         ///< pixel samples a second of a thread, the geometric mean
  double spread = 1;          ///< the fastest over the slowest
  std::uint32_t first = 0;    ///< number of the first worker: names and speeds follow from it
};

/// Pixel samples a second of the worker's threads together.
double speed_of(const SwarmOptions& options, std::uint32_t number);
/// And of all workers.
double speed_of(const SwarmOptions& options);

/// What a swarm has done so far.
struct SwarmCounts {
  std::uint32_t connected = 0;
  std::uint64_t disconnects = 0;  ///< of those who were connected, also if they have come back
  std::uint64_t leases = 0, results = 0, result_bytes = 0, acknowledged = 0;
  double busy_seconds = 0;  ///< of all threads
};

/// Seconds, in no order: from when a result is handed to gRPC until gRPC hands over what answers it.
struct SwarmLatencies {
  /// From the first result that leaves a worker with fewer leases or tiles than a coordinator gives one, until its next
  /// lease.
  std::vector<double> lease;
  std::vector<double> commit;  ///< from a result until it is acknowledged, which is when it is durable
};

class SwarmMember;

class Swarm {
 public:
  /// Its workers start to connect, a thousand a second.
  explicit Swarm(SwarmOptions options);
  /// Ends all connections, which the coordinator is told at once, as when processes are killed.
  ~Swarm();
  Swarm(const Swarm&) = delete;
  Swarm& operator=(const Swarm&) = delete;

  SwarmCounts counts() const;
  /// Those since the last call.
  SwarmLatencies take_latencies();

 private:
  friend class SwarmMember;
  struct Inbox;

  void run(const std::stop_token& stop);

  const SwarmOptions options_;
  const std::unique_ptr<Inbox> inbox_;
  std::vector<SwarmMember*> touched_;  ///< on its thread: something has come for them
  mutable Mutex mutex_;
  SwarmCounts counts_ LM_GUARDED_BY(mutex_);
  SwarmLatencies latencies_ LM_GUARDED_BY(mutex_);
  std::jthread thread_;  ///< the last: it uses the others
};

}  // namespace lightmill::bench

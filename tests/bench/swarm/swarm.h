// Thousands of workers in one process. Each is a real session on its own real connection, and only its render threads
// are simulated. A tile takes the time that the stated speed gives. Its node is a copy of one that was created and
// hashed before. So this process only copies nodes and runs gRPC.
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
  double speed = 1e6;         ///< pixel samples per second and thread, the geometric mean
  double spread = 1;          ///< ratio of the fastest to the slowest
  std::uint32_t first = 0;    ///< number of the first worker; names and speeds follow from it
};

/// Pixel samples per second of all threads of a worker.
double speed_of(const SwarmOptions& options, std::uint32_t number);
/// The same of all workers.
double speed_of(const SwarmOptions& options);

/// Work of a swarm so far.
struct SwarmCounts {
  std::uint32_t connected = 0;
  std::uint64_t disconnects = 0;  ///< of connected workers, also of those that reconnected
  std::uint64_t leases = 0, results = 0, result_bytes = 0, acknowledged = 0;
  double busy_seconds = 0;  ///< of all threads
};

/// Latencies in seconds, in no order. They run from handing a result to gRPC until gRPC delivers the answer.
struct SwarmLatencies {
  /// From the result after which the worker has too few leases or tiles until its next lease.
  std::vector<double> lease;
  std::vector<double> commit;  ///< from a result until its acknowledgement, when it is durable
};

class SwarmMember;

class Swarm {
 public:
  /// Starts to connect its workers, a thousand per second.
  explicit Swarm(SwarmOptions options);
  /// Closes all connections at once, as when processes are killed.
  ~Swarm();
  Swarm(const Swarm&) = delete;
  Swarm& operator=(const Swarm&) = delete;

  SwarmCounts counts() const;
  /// Latencies since the last call.
  SwarmLatencies take_latencies();

 private:
  friend class SwarmMember;
  struct Inbox;

  void run(const std::stop_token& stop);

  const SwarmOptions options_;
  const std::unique_ptr<Inbox> inbox_;
  std::vector<SwarmMember*> touched_;  ///< used on its thread: members with new events
  mutable Mutex mutex_;
  SwarmCounts counts_ LM_GUARDED_BY(mutex_);
  SwarmLatencies latencies_ LM_GUARDED_BY(mutex_);
  std::jthread thread_;  ///< last, because it uses the others
};

}  // namespace lightmill::bench

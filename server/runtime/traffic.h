// Traffic of the coordinator since its start: bytes inside messages, without the overhead of protocols.
#pragma once

#include <atomic>
#include <cstdint>

namespace lightmill {

/// Thread-safe.
struct Traffic {
  std::atomic<std::uint64_t> results_in = 0;    ///< all messages on streams of workers
  std::atomic<std::uint64_t> assets_in = 0;     ///< uploads
  std::atomic<std::uint64_t> assets_out = 0;    ///< downloads by workers and users
  std::atomic<std::uint64_t> films_out = 0;     ///< downloads over gRPC
  std::atomic<std::uint64_t> previews_out = 0;  ///< to watchers of jobs, and to open pages
  std::atomic<std::uint64_t> answers_out = 0;   ///< JSON and pictures over HTTP
};

}  // namespace lightmill

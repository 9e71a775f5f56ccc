// Bytes that went through the coordinator since it began: what is inside messages, without what carries them.
#pragma once

#include <atomic>
#include <cstdint>

namespace lightmill {

/// Thread-safe.
struct Traffic {
  std::atomic<std::uint64_t> results_in = 0;    ///< all that workers say on their streams
  std::atomic<std::uint64_t> assets_in = 0;     ///< as they are uploaded
  std::atomic<std::uint64_t> assets_out = 0;    ///< as workers and people fetch them
  std::atomic<std::uint64_t> films_out = 0;     ///< as they are fetched by gRPC
  std::atomic<std::uint64_t> previews_out = 0;  ///< to who watches a job, and to open pages
  std::atomic<std::uint64_t> answers_out = 0;   ///< the JSON API's and pictures
};

}  // namespace lightmill

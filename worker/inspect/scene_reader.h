// The scene reader: a process that reads one uploaded scene for a worker.
//
// It has limits of memory and CPU time, and the worker ends it after a minute. The kernel kills it before the worker if
// the machine has no memory left. It gets the scene's files from the worker, and no secrets. It is not confined like
// the image decoder, because the parsers of scene files are part of Lightmill.
#pragma once

#include <cstdint>
#include <type_traits>

#include "worker/render/scene_limits.h"

namespace lightmill {

/// The option with which `lightmill-worker` is a scene reader. Its standard input is a socket to the worker.
inline constexpr const char* kSceneReaderOption = "--scene-reader";

/// First part of the worker's first message.
struct ReaderStart {
  SceneLimits limits;
  std::uint64_t memory_bytes = 0;  ///< beyond that of the program itself
  std::uint64_t cpu_seconds = 0;
  std::int64_t image_ms = 0;  ///< DecoderOptions::time_limit
  std::uint32_t unsandboxed = 0;
  std::uint32_t decoder_path_bytes = 0;
};
static_assert(std::is_trivially_copyable_v<ReaderStart>);

/// Exit code of a reader that ran out of memory where no error could be returned.
inline constexpr int kReaderOutOfMemory = 3;

/// RESOURCE_EXHAUSTED: reading takes more memory than the reader may have.
Status reader_out_of_memory(std::uint64_t memory_bytes);

/// Reads one scene, and returns the exit code. The process must be new.
int run_scene_reader();

}  // namespace lightmill

// Limits of one scene on a worker, and errors where memory or threads run out.
#pragma once

#include <cstdint>
#include <new>
#include <string_view>
#include <system_error>

#include "common/base/status.h"
#include "common/image/decoder/decoder_process.h"
#include "common/image/texels.h"
#include "common/scene/compiled/compiled_scene.h"

namespace lightmill {

/// A scene beyond a limit is refused with RESOURCE_EXHAUSTED and the name of the setting.
struct SceneLimits {
  std::uint64_t bytes = std::uint64_t{16} << 30;        ///< estimate for compiling, made before it starts
  std::uint64_t triangles = kMaxSceneTriangles;         ///< instances of a mesh count once
  std::int64_t image_pixels = kMaxTexturePixels;        ///< of one decoded image
  std::uint64_t images_bytes = std::uint64_t{8} << 30;  ///< of all decoded images
  double seconds = 600;                                 ///< to prepare it, without the time in which assets arrive
};

/// Checks the memory before anything is decoded. The system kills a worker that runs out of memory, and other jobs on
/// it lose their results.
Status check_memory(const Scene& scene, const CompiledScene::AssetSource& assets, DecoderProcess& images,
                    std::uint64_t max_bytes);

/// "out of memory while samples were rendered: …", with advice.
Status out_of_memory_error(std::string_view while_what);
Status out_of_threads_error(std::string_view while_what, const std::system_error& error);

/// Returns the Result of `make`. RESOURCE_EXHAUSTED if memory runs out, or a thread cannot start.
template <class Make>
auto within_limits(std::string_view while_what, const Make& make) -> decltype(make()) {
  try {
    return make();
  } catch (const std::bad_alloc&) {
    return out_of_memory_error(while_what);
  } catch (const std::system_error& error) {
    return out_of_threads_error(while_what, error);
  }
}

}  // namespace lightmill

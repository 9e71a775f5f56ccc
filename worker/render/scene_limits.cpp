#include "worker/render/scene_limits.h"

#include "common/base/machine_memory.h"
#include "common/base/number_text.h"
#include "common/scene/compiled/scene_memory.h"

namespace lightmill {

Status check_memory(const Scene& scene, const CompiledScene::AssetSource& assets, DecoderProcess& images,
                    std::uint64_t max_bytes) {
  const auto sizes = [&](ByteView bytes, const std::string& name) -> Result<ImageSize> {
    if (bytes.size() > max_bytes / 2) {  // the decoder would get a copy; the estimate refuses the file by name
      return resource_exhausted("{} has {} bytes", name, bytes.size());
    }
    return images.size(bytes, name);
  };
  LM_ASSIGN_OR_RETURN(const SceneMemory memory, estimate_memory(scene, assets, sizes));
  return memory.bytes <= max_bytes
             ? ok_status()
             : resource_exhausted(
                   "the scene takes about {:.3g} GiB of memory, more than --scene-gib {:.3g} of this worker allows. "
                   "Its largest part, {}, takes {:.3g} GiB",
                   gib(memory.bytes), gib(max_bytes), memory.largest, gib(memory.largest_bytes));
}

Status out_of_memory_error(std::string_view while_what) {
  const std::uint64_t usable = usable_memory();
  return resource_exhausted(
      "out of memory while {}: this worker may use {}. Give it more, or run it with fewer --threads", while_what,
      usable > 0 ? human_bytes(usable) : "an unknown amount");
}

Status out_of_threads_error(std::string_view while_what, const std::system_error& error) {
  return resource_exhausted(
      "no further thread or process can start while {} ({}): raise the limit of the worker's tasks (ulimit -u, "
      "pids.max, TasksMax) or of its memory (ulimit -v)",
      while_what, error.what());
}

}  // namespace lightmill

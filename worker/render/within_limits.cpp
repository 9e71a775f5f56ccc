#include "worker/render/within_limits.h"

#include "common/base/machine_memory.h"
#include "common/base/quantities.h"

namespace lightmill {

Status out_of_memory_error(std::string_view while_what) {
  const std::uint64_t usable = usable_memory();
  return resource_exhausted(
      "out of memory while {}: this worker may use {}; give it more, or run it with fewer --threads", while_what,
      usable > 0 ? human_bytes(usable) : "an unknown amount");
}

Status out_of_threads_error(std::string_view while_what, const std::system_error& error) {
  return resource_exhausted(
      "no further thread or process can start while {} ({}): raise the limit of the worker's tasks (ulimit -u, "
      "pids.max, TasksMax) or of its memory (ulimit -v)",
      while_what, error.what());
}

}  // namespace lightmill

#include "common/base/file_limit.h"

#include <sys/resource.h>

#include "common/base/check.h"

namespace lightmill {

std::uint64_t raise_file_limit() {
  rlimit limit{};
  LM_CHECK(::getrlimit(RLIMIT_NOFILE, &limit) == 0);
  const rlimit most{limit.rlim_max, limit.rlim_max};
  return ::setrlimit(RLIMIT_NOFILE, &most) == 0 ? most.rlim_cur : limit.rlim_cur;
}

}  // namespace lightmill

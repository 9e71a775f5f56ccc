// Logging by spdlog: one line per event that matters, to standard error, as text or as JSON lines.
#pragma once

#include <spdlog/spdlog.h>

#include <cstdint>
#include <string>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"

// spdlog formats in place, which costs every file that logs more than two seconds to compile. log.cpp has the code.
extern template void fmt::detail::vformat_to<char>(buffer<char>&, string_view, basic_format_args<buffer_context<char>>,
                                                   locale_ref);

namespace lightmill {

/// Sets up the process's logger. `level` is trace, debug, info, warn, error or off; `format` is text or json; `program`
/// stands in every line. Call once, before threads start.
Status start_logging(std::string_view program, std::string_view level, std::string_view format);

/// As long as it lives, its thread's lines end with trace_id=…, and with span_id=… if `span` is not 0 (in JSON they are
/// fields of these names), as logs in OpenTelemetry's terms do: 32 and 16 hexadecimal digits. A trace of zeros is none.
/// Not nested.
class LogTrace {
 public:
  explicit LogTrace(const Hash128& trace, std::uint64_t span = 0);
  ~LogTrace();
  LogTrace(const LogTrace&) = delete;
  LogTrace& operator=(const LogTrace&) = delete;
};

}  // namespace lightmill

// Logging with spdlog: one line per event, to standard error, as text or as JSON lines.
#pragma once

#include <spdlog/spdlog.h>

#include <cstdint>
#include <string_view>

#include "common/base/digest.h"
#include "common/base/status.h"

// Every file that logs would compile spdlog's formatting, for more than two seconds. This code is compiled once, in
// log.cpp.
extern template void fmt::detail::vformat_to<char>(buffer<char>&, string_view, basic_format_args<buffer_context<char>>,
                                                   locale_ref);

namespace lightmill {

/// Sets up the process's logger. `level` is trace, debug, info, warn, error or off. `format` is text or json. Each line
/// has its time in UTC, and names `program`. In a terminal, levels are coloured if colors_wanted. Errors name the
/// program's options --log-level and --log-format. Call once, before threads start.
Status start_logging(std::string_view program, std::string_view level, std::string_view format);

/// Adds trace_id=…, and span_id=… if `span` is not 0, to the log lines of its thread while it lives. In JSON they are
/// fields. They have 32 and 16 hexadecimal digits, as in OpenTelemetry. A trace of zeros adds nothing. Inside of
/// another one, it replaces that while it lives.
class LogTrace {
 public:
  explicit LogTrace(const Hash128& trace, std::uint64_t span = 0);
  ~LogTrace();
  LogTrace(const LogTrace&) = delete;
  LogTrace& operator=(const LogTrace&) = delete;

 private:
  const Hash128 outer_trace_;
  const std::uint64_t outer_span_;
};

}  // namespace lightmill

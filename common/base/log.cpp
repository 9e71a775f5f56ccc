#include "common/base/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <unistd.h>

#include <utility>

#include "common/base/suggestion.h"
#include "common/base/text_width.h"

template void fmt::detail::vformat_to<char>(buffer<char>&, string_view, basic_format_args<buffer_context<char>>,
                                            locale_ref);

namespace lightmill {
namespace {

/// The message as the inside of a JSON string.
class JsonEscapedMessage final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    for (const char c : message.payload) {
      const auto byte = static_cast<unsigned char>(c);
      if (c == '"' || c == '\\') {
        out.push_back('\\');
        out.push_back(c);
      } else if (byte < 0x20) {
        fmt::format_to(fmt::appender(out), "\\u{:04x}", byte);
      } else {
        out.push_back(c);
      }
    }
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<JsonEscapedMessage>(); }
};

thread_local Hash128 current_trace;
thread_local std::uint64_t current_span = 0;

/// The fields that LogTrace set, with their separators from the rest of the line.
class TraceFields final : public spdlog::custom_flag_formatter {
 public:
  explicit TraceFields(bool json) : json_(json) {}
  void format(const spdlog::details::log_msg&, const std::tm&, spdlog::memory_buf_t& out) override {
    if (current_trace != Hash128{}) {
      add("trace_id", current_trace.hex(), out);
      if (current_span != 0) {
        add("span_id", fmt::format("{:016x}", current_span), out);
      }
    }
  }
  std::unique_ptr<custom_flag_formatter> clone() const override { return std::make_unique<TraceFields>(json_); }

 private:
  void add(std::string_view name, const std::string& value, spdlog::memory_buf_t& out) const {
    if (json_) {
      fmt::format_to(fmt::appender(out), R"(,"{}":"{}")", name, value);
    } else {
      fmt::format_to(fmt::appender(out), " {}={}", name, value);
    }
  }
  bool json_;
};

}  // namespace

LogTrace::LogTrace(const Hash128& trace, std::uint64_t span)
    : outer_trace_(std::exchange(current_trace, trace)), outer_span_(std::exchange(current_span, span)) {}
LogTrace::~LogTrace() {
  current_trace = outer_trace_;
  current_span = outer_span_;
}

Status start_logging(std::string_view program, std::string_view level, std::string_view format) {
  const auto parsed = spdlog::level::from_str(std::string(level));
  if (parsed == spdlog::level::off && level != "off") {
    return invalid_argument("--log-level: {}",
                            unknown_text("level", level, {"trace", "debug", "info", "warn", "error", "off"}));
  }
  auto logger = spdlog::stderr_color_mt(std::string(program),
                                        colors_wanted() ? spdlog::color_mode::automatic : spdlog::color_mode::never);
  auto formatter = std::make_unique<spdlog::pattern_formatter>(spdlog::pattern_time_type::utc);
  if (format == "json") {
    formatter->add_flag<JsonEscapedMessage>('*').add_flag<TraceFields>('~', true);
    formatter->set_pattern(R"({"time":"%Y-%m-%dT%H:%M:%S.%eZ","level":"%l","program":"%n","pid":%P,"message":"%*"%~})");
  } else if (format == "text") {
    formatter->add_flag<TraceFields>('~', false).set_pattern("%Y-%m-%d %H:%M:%S.%eZ %^%-5l%$ %n: %v%~");
  } else {
    return invalid_argument("--log-format: {}", unknown_text("format", format, {"text", "json"}));
  }
  logger->set_formatter(std::move(formatter));
  logger->set_level(parsed);
  logger->flush_on(spdlog::level::info);
  spdlog::set_default_logger(std::move(logger));
  return ok_status();
}

}  // namespace lightmill

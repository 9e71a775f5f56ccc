#include "common/base/openjd.h"

#include <fmt/format.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <mutex>

#include "common/base/text.h"

namespace lightmill {
namespace {

std::string one_line(std::string_view name, std::string_view text) {
  std::string line(text);
  std::ranges::replace(line, '\n', ' ');
  return fmt::format("openjd_{}: {}", name, printable(line));
}

class StatusSink final : public spdlog::sinks::base_sink<std::mutex> {
 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (message.level >= spdlog::level::info) {
      std::puts(openjd_status({message.payload.data(), message.payload.size()}).c_str());
    }
  }
  void flush_() override { std::fflush(stdout); }
};

}  // namespace

std::string openjd_progress(double fraction) {
  return fmt::format("openjd_progress: {:.1f}", 100 * std::clamp(fraction, 0.0, 1.0));
}

std::string openjd_status(std::string_view text) {
  return one_line("status", text);
}

std::string openjd_fail(std::string_view text) {
  return one_line("fail", text);
}

void log_as_openjd_status() {
  std::setvbuf(stdout, nullptr, _IOLBF, BUFSIZ);
  spdlog::default_logger()->sinks().push_back(std::make_shared<StatusSink>());
}

}  // namespace lightmill

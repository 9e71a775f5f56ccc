#include "worker/render/worker_class.h"

#include <future>

#include "common/base/clock.h"
#include "common/base/digest.h"
#include "common/base/log.h"
#include "common/image/decoder/decoder_process.h"
#include "common/methods/fingerprint.h"

namespace lightmill {

std::string worker_class(const std::filesystem::path& decoder) {
  // In parallel with the test render, because loading the decoder's libraries takes as long. If no thread can start,
  // the decoder comes after the test render.
  std::future<Result<std::string>> images = std::async(std::launch::async | std::launch::deferred, [&decoder] {
    return fingerprint_of_decoder(decoder, system_clock());
  });
  const std::string rendered = fingerprint_class();
  const Result<std::string> read = images.get();
  if (!read.ok()) {
    spdlog::warn(
        "the image decoder does not work: {}. This worker only renders jobs of workers without a decoder. Correct this, then "
        "restart the worker",
        message_of(read.status()));
  }
  return sha256(fmt::format("{} {}", rendered, read.ok() ? *read : "no images")).hex().substr(0, 16);
}

}  // namespace lightmill

// Cost of the image decoder's sandbox: the same images decoded in the sandbox and in this process.
#include <fmt/format.h>
#include <malloc.h>

#include <CLI/CLI.hpp>
#include <chrono>

#include "common/base/check.h"
#include "common/image/decoder/decoder_process.h"
#include "common/image/exr.h"
#include "common/image/png.h"
#include "tests/support/paths.h"
#include "tests/support/read_image.h"

namespace {

using namespace lightmill;

std::string png(int side) {
  std::vector<std::uint8_t> rgb(3 * static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (std::size_t i = 0; i < rgb.size(); ++i) {
    rgb[i] = static_cast<std::uint8_t>(i * i >> 7);
  }
  return encode_png(side, side, rgb).value();
}

std::string exr(int side) {
  std::vector<float> values(static_cast<std::size_t>(side) * static_cast<std::size_t>(side));
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<float>(i % 977) / 977;
  }
  Image image;
  image.display = image.data = {0, 0, side, side};
  for (const char* channel : {"R", "G", "B"}) {
    image.channels.push_back({channel, values});
  }
  return encode_exr(image).value();
}

/// Time of the fastest round in ms, because other processes only add time.
double time_of(int rounds, const std::function<Status()>& work) {
  double fastest = std::numeric_limits<double>::infinity();
  for (int round = 0; round < rounds; ++round) {
    const auto start = std::chrono::steady_clock::now();
    const Status status = work();
    LM_CHECK(status.ok(), "{}", message_of(status));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    fastest = std::min(fastest, took.count());
  }
  return fastest;
}

}  // namespace

int main(int argc, char** argv) {
  int rounds = 51;
  CLI::App app("Times decoding in the sandbox and in this process");
  app.add_option("--rounds", rounds, "decodings of each image")->check(CLI::Range(1, 100000))->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  // A scene keeps its images, so each image takes new memory. This prevents reuse here.
  ::mallopt(M_MMAP_THRESHOLD, 1 << 17);
  DecoderProcess decoder({.program = test::program("lightmill-image-decoder")});
  const std::string first = png(2);
  fmt::print("start with a first image: {:.0f} ms\n",
             time_of(1, [&] { return decoder.decode(as_byte_view(first), "first").status(); }));
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  fmt::print("{:>14} {:>12} {:>12} {:>12} {:>12}\n", "image", "size, ms", "sandbox, ms", "here, ms", "cost, ms");
  for (const auto& [name, file] : std::vector<std::pair<std::string, std::string>>{{"2x2 png", first},
                                                                                   {"512x512 png", png(512)},
                                                                                   {"1024x1024 png", png(1024)},
                                                                                   {"2048x2048 png", png(2048)},
                                                                                   {"1024x1024 exr", exr(1024)},
                                                                                   {"2048x2048 exr", exr(2048)}}) {
    const ByteView bytes = as_byte_view(file);
    const double size = time_of(rounds, [&] { return decoder.size(bytes, name).status(); });
    const double there = time_of(rounds, [&] { return decoder.decode(bytes, name).status(); });
    const double here = time_of(rounds, [&] { return read_image(bytes, name).status(); });
    fmt::print("{:>14} {:>12.2f} {:>12.2f} {:>12.2f} {:>12.2f}\n", name, size, there, here, there - here);
  }
  return 0;
}

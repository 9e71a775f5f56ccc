#include "common/farm/job.h"

#include <algorithm>

#include "common/methods/spec/method_spec.h"

namespace lightmill {
namespace {

/// Appends length-prefixed fields, so that different settings give different bytes.
class FieldHasher {
 public:
  void text(std::string_view value) {
    number(value.size());
    hasher_.append(value);
  }
  void number(std::uint64_t value) {
    std::array<std::uint8_t, 8> bytes;
    for (int i = 0; i < 8; ++i) {
      bytes[i] = static_cast<std::uint8_t>(value >> (8 * i));
    }
    hasher_.append(std::as_bytes(std::span(bytes)));
  }
  Sha256 finish() { return hasher_.finish(); }

 private:
  Sha256Hasher hasher_;
};

}  // namespace

std::string_view name_of(JobState state) {
  constexpr std::array<std::string_view, kJobStates.size()> kNames{"queued", "running", "paused",
                                                                   "done",   "failed",  "cancelled"};
  return kNames.at(static_cast<std::size_t>(state));
}

Sha256 render_digest(const RenderSettings& settings, const std::string& fingerprint_class) {
  FieldHasher hasher;
  hasher.text("lightmill render digest 1");
  hasher.text(*settings.scene);
  hasher.number(settings.assets->size());
  for (const Sha256& asset : *settings.assets) {
    hasher.text(asset.hex());
  }
  for (const int value :
       {settings.width, settings.height, settings.crop.x, settings.crop.y, settings.crop.width, settings.crop.height}) {
    hasher.number(static_cast<std::uint64_t>(value));
  }
  hasher.number(settings.layers.size());
  for (const LayerSpec& layer : settings.layers) {
    hasher.text(layer.name);
    hasher.number(layer.channels);
    hasher.number(static_cast<std::uint64_t>(layer.kind));
  }
  hasher.number(settings.seed);
  hasher.text(settings.method);
  hasher.number(settings.max_bounces);
  hasher.text(settings.renderer_version);
  hasher.text(fingerprint_class);
  if (settings.meters > 0) {
    hasher.number(settings.meters);
  }
  return hasher.finish();
}

Hash128 trace_id(const std::string& request_id) {
  const Result<Hash128> given = Hash128::from_hex(request_id);
  return given.ok() && *given != Hash128{} ? *given : xxh3_128(as_byte_view(request_id));
}

bool may_gather(const RenderSettings& settings, const MethodNotes& notes) {
  std::vector<std::string> methods = notes.candidates;
  methods.push_back(settings.method);
  return std::ranges::any_of(methods, [](const std::string& text) {
    const Result<MethodSpec> method = parse_method(text);
    return method.ok() && method_gathers(method->name);
  });
}

}  // namespace lightmill

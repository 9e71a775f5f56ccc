// Examples of what programs of a farm send, with a value in each field.
#pragma once

#include <algorithm>
#include <limits>

#include "common/farm/messages.h"

namespace lightmill::test {

inline RenderSettings example_settings() {
  RenderSettings settings;
  settings.scene = std::string("scene\0bytes", 11);
  std::vector<Sha256> assets{sha256("a"), sha256("b")};
  std::ranges::sort(assets);
  settings.assets = assets;
  settings.width = 640;
  settings.height = 480;
  settings.crop = {10, 20, 630, 460};
  settings.layers = {{"beauty", 3, LayerKind::summed},
                     {"direct", 3, LayerKind::summed},
                     {"normal", 3, LayerKind::first_mean},
                     {"depth", 1, LayerKind::first_nearest},
                     {"id", 1, LayerKind::first_samples}};
  settings.meters = 3;
  settings.seed = std::numeric_limits<std::uint64_t>::max();
  settings.method = "path";
  settings.max_bounces = 7;
  settings.renderer_version = kRendererVersion;
  return settings;
}

inline JobSpec example_spec() {
  JobSpec spec;
  spec.request_id = "request-1";
  spec.name = "box";
  spec.owner = "ada";
  spec.host = "engine";
  spec.parent = JobId{17};
  spec.priority = -3;
  spec.audit_share = 0.25;
  spec.allow_mixed = true;
  spec.goal = {300, 12.5, 0.0123, true};
  spec.settings = example_settings();
  return spec;
}

inline WorkerResult example_result() {
  WorkerResult result;
  result.lease = LeaseId{9};
  result.key = {JobId{4}, TileId{63}, {3, 5}};
  result.node.range = result.key.range;
  result.node.values = {0.0f, 1.5f, -2.25f, std::numeric_limits<float>::denorm_min(), 3e38f, 7.0f};
  result.node.non_finite = 2;
  result.hash = hash_of(result.node);
  result.render_digest = sha256("job");
  result.seconds = 0.25;
  result.trace = {3, 4};
  result.tag = sha256("tag");
  return result;
}

}  // namespace lightmill::test

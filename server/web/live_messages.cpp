#include "server/web/live_messages.h"

#include <algorithm>

#include "common/base/text.h"
#include "common/film/layers.h"
#include "common/film/tile_grid.h"
#include "common/methods/spec/method_spec.h"
#include "common/wire/farm_messages.h"
#include "lightmill/v1/web.pb.h"
#include "server/access/rights.h"
#include "server/operations/messages.h"
#include "server/operations/operation.h"

namespace lightmill {
namespace {

void append_varint(std::string& out, std::uint64_t value) {
  for (; value >= 0x80; value >>= 7) {
    out.push_back(static_cast<char>(value | 0x80));
  }
  out.push_back(static_cast<char>(value));
}

/// A length-delimited field in protobuf's encoding.
void append_field(std::string& out, int field, std::string_view bytes) {
  append_varint(out, static_cast<std::uint64_t>(field) << 3 | 2);
  append_varint(out, bytes.size());
  out.append(bytes);
}

/// Encodes JobChanges or WorkerChanges: `changes` has the small fields, and `entries` the encoded rest.
template <class Changes>
std::string with_entries(const Changes& changes, int field, const std::vector<SharedBytes>& entries) {
  std::string bytes = changes.SerializeAsString();
  for (const SharedBytes& entry : entries) {
    append_field(bytes, field, *entry);
  }
  return bytes;
}

void to_wire(std::string_view method, v1::MethodFacts* out) {
  out->set_name(std::string(method));
  for (const LayerSpec& layer : all_layers(method, {})) {
    out->add_layers(layer.name);
  }
  out->set_light_groups(method_follows_all_light(method));
  out->set_meters(method_reads_meters(method));
  out->set_max_bounces(max_bounces_of(method));
}

}  // namespace

Result<ViewRequest> parse_view_request(std::string_view bytes) {
  v1::ViewRequest wire;
  if (!wire.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return invalid_argument("the message of {} bytes is not a ViewRequest", bytes.size());
  }
  if (wire.layers_size() > kMaxViewLayers) {
    return invalid_argument("layers: {} were requested, the limit is {}", wire.layers_size(), kMaxViewLayers);
  }
  ViewRequest request{wire.hidden(), wire.jobs(), wire.workers(), JobId{wire.job()}, wire.seen(), {}, wire.page()};
  for (const std::string& layer : wire.layers()) {
    if (!layer.empty() && layer != kBeautyLayer && std::ranges::find(request.layers, layer) == request.layers.end()) {
      request.layers.push_back(layer);
    }
  }
  return request;
}

std::string job_bytes(const JobStatus& job, bool whole) {
  v1::Job wire;
  to_wire(job, &wire);
  if (!whole) {
    wire.clear_history();
  }
  return wire.SerializeAsString();
}

std::string worker_bytes(const WorkerStatus& worker) {
  v1::Worker wire;
  to_wire(worker, &wire);
  return wire.SerializeAsString();
}

std::string tile_field(JobId job, const std::string& layer, const PixelRect& rect, std::uint64_t samples,
                       const std::string& pixels) {
  v1::ViewTile wire;
  wire.set_job(job.value);
  to_wire(rect, wire.mutable_rect());
  wire.set_samples(samples);
  wire.set_rgbe(pixels);
  wire.set_layer(layer);
  std::string bytes;
  append_field(bytes, v1::ViewUpdate::kTilesFieldNumber, wire.SerializeAsString());
  return bytes;
}

void to_wire(const FarmGreeting& greeting, v1::FarmGreeting* out) {
  out->set_version(greeting.version);
  out->set_renderer_version(kRendererVersion);
  out->mutable_notices()->Add(greeting.notices.begin(), greeting.notices.end());
  out->set_caller(greeting.caller.name);
  for (const Role role : kRoles) {
    if (greeting.caller.roles.has(role)) {
      out->add_roles(std::string(name_of(role)));
    }
  }
  for (const std::string_view method : allowed_methods(served_rpcs(), greeting.caller, false)) {
    out->add_may(std::string(method));
  }
  for (const std::string_view method : allowed_methods(served_rpcs(), greeting.caller, true)) {
    out->add_may_with_own(std::string(method));
  }
  for (const std::string_view method : method_names()) {
    to_wire(method, out->add_methods());
  }
  out->set_max_side(kMaxFilmSide);
  out->set_max_name_bytes(kMaxNameBytes);
}

void ViewUpdateWriter::greet(const FarmGreeting& greeting) {
  v1::FarmGreeting wire;
  to_wire(greeting, &wire);
  append_field(bytes_, v1::ViewUpdate::kGreetingFieldNumber, wire.SerializeAsString());
}

void ViewUpdateWriter::jobs(const std::vector<SharedBytes>& jobs, const std::vector<JobId>& removed, bool whole) {
  v1::JobChanges changes;
  changes.set_whole(whole);
  for (const JobId job : removed) {
    changes.add_removed(job.value);
  }
  append_field(bytes_, v1::ViewUpdate::kJobsFieldNumber, with_entries(changes, v1::JobChanges::kJobsFieldNumber, jobs));
}

void ViewUpdateWriter::workers(const std::vector<SharedBytes>& workers, const std::vector<std::string>& removed,
                               bool whole) {
  v1::WorkerChanges changes;
  changes.set_whole(whole);
  changes.mutable_removed()->Add(removed.begin(), removed.end());
  append_field(bytes_, v1::ViewUpdate::kWorkersFieldNumber,
               with_entries(changes, v1::WorkerChanges::kWorkersFieldNumber, workers));
}

void ViewUpdateWriter::job(const std::string& bytes) {
  append_field(bytes_, v1::ViewUpdate::kJobFieldNumber, bytes);
}

void ViewUpdateWriter::job_failure(const Status& why) {
  append_field(bytes_, v1::ViewUpdate::kJobFailureFieldNumber, message_of(why));
}

void ViewUpdateWriter::layer_failure(JobId job, const std::string& layer, const Status& why) {
  v1::LayerFailure wire;
  wire.set_job(job.value);
  wire.set_layer(layer);
  wire.set_why(why.ok() ? "" : message_of(why));
  append_field(bytes_, v1::ViewUpdate::kLayerFailuresFieldNumber, wire.SerializeAsString());
}

}  // namespace lightmill

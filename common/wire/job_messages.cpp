#include "common/farm/job_rules.h"
#include "common/wire/bytes.h"
#include "common/wire/enum_table.h"
#include "common/wire/farm_messages.h"
#include "common/wire/limits.h"
#include "lightmill/v1/farm.pb.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill {
namespace {

constexpr EnumTable<JobState, v1::JobState, 6> kJobStateCodes{{{JobState::queued, v1::JOB_STATE_QUEUED},
                                                               {JobState::running, v1::JOB_STATE_RUNNING},
                                                               {JobState::paused, v1::JOB_STATE_PAUSED},
                                                               {JobState::done, v1::JOB_STATE_DONE},
                                                               {JobState::failed, v1::JOB_STATE_FAILED},
                                                               {JobState::cancelled, v1::JOB_STATE_CANCELLED}}};

constexpr EnumTable<GoalLimit, v1::GoalLimit, 4> kGoalLimits{{{GoalLimit::none, v1::GOAL_LIMIT_UNSPECIFIED},
                                                              {GoalLimit::samples, v1::GOAL_LIMIT_SAMPLES},
                                                              {GoalLimit::seconds, v1::GOAL_LIMIT_SECONDS},
                                                              {GoalLimit::error, v1::GOAL_LIMIT_ERROR}}};

constexpr EnumTable<LayerKind, v1::LayerSpec::Kind, 4> kLayerKinds{
    {{LayerKind::summed, v1::LayerSpec::SUMMED},
     {LayerKind::first_mean, v1::LayerSpec::FIRST_MEAN},
     {LayerKind::first_nearest, v1::LayerSpec::FIRST_NEAREST},
     {LayerKind::first_samples, v1::LayerSpec::FIRST_SAMPLES}}};

Result<std::vector<LayerSpec>> layers_from_wire(const v1::RenderSettings& settings) {
  if (settings.layers().empty() || settings.layers_size() > static_cast<int>(kMaxLayers)) {
    return invalid_argument("settings.layers: 1 to {} are expected, got {}", kMaxLayers, settings.layers_size());
  }
  std::vector<LayerSpec> layers;
  std::uint64_t channels = 0;
  for (const v1::LayerSpec& layer : settings.layers()) {
    LM_RETURN_IF_ERROR(check_length("settings.layers.name", layer.name(), kMaxWireNameBytes));
    if (layer.name().empty() || layer.channels() < 1) {
      return invalid_argument("settings.layers: a layer needs a name and at least one channel, got '{}' with {}",
                              layer.name(), layer.channels());
    }
    LM_ASSIGN_OR_RETURN(const LayerKind kind, value_of(kLayerKinds, layer.kind(),
                                                       fmt::format("settings.layers: kind of '{}'", layer.name())));
    channels += layer.channels();
    layers.push_back({layer.name(), layer.channels(), kind});
  }
  if (channels > kMaxChannels) {
    return invalid_argument("settings.layers: {} channels in all are more than the limit of {}", channels,
                            kMaxChannels);
  }
  return layers;
}

Result<std::vector<Sha256>> assets_from_wire(const v1::RenderSettings& settings) {
  if (settings.assets_size() > static_cast<int>(kMaxAssets)) {
    return invalid_argument("settings.assets: {} are more than the limit of {}", settings.assets_size(), kMaxAssets);
  }
  std::vector<Sha256> assets;
  assets.reserve(settings.assets_size());
  for (int i = 0; i < settings.assets_size(); ++i) {
    Result<Sha256> digest = digest_from_bytes(settings.assets(i));
    if (!digest.ok()) {
      return with_context(digest.status(), fmt::format("settings.assets[{}]", i));
    }
    if (i > 0 && *digest <= assets.back()) {
      return invalid_argument("settings.assets[{}]: digests must be sorted, each once", i);
    }
    assets.push_back(*digest);
  }
  return assets;
}

}  // namespace

v1::JobState to_wire(JobState state) {
  return code_of(kJobStateCodes, state);
}

Result<JobState> from_wire(v1::JobState state) {
  return value_of(kJobStateCodes, state, "state");
}

v1::GoalLimit to_wire(GoalLimit limit) {
  return code_of(kGoalLimits, limit);
}

Result<GoalLimit> from_wire(v1::GoalLimit limit) {
  return value_of(kGoalLimits, limit, "reached");
}

void to_wire(const PixelRect& rect, v1::PixelRect* out) {
  out->set_x(rect.x);
  out->set_y(rect.y);
  out->set_width(rect.width);
  out->set_height(rect.height);
}

Result<PixelRect> from_wire(const v1::PixelRect& rect) {
  const auto within = [](int value) { return value == 0 || is_film_side(value); };
  if (!within(rect.x()) || !within(rect.y()) || !within(rect.width()) || !within(rect.height())) {
    return invalid_argument("rectangle numbers must be 0 to {}, got x {}, y {}, width {}, height {}", kMaxFilmSide,
                            rect.x(), rect.y(), rect.width(), rect.height());
  }
  return PixelRect{rect.x(), rect.y(), rect.width(), rect.height()};
}

void to_wire(const RenderSettings& settings, v1::RenderSettings* out) {
  out->set_scene(*settings.scene);
  for (const Sha256& asset : *settings.assets) {
    out->add_assets(digest_bytes(asset));
  }
  out->set_width(settings.width);
  out->set_height(settings.height);
  to_wire(settings.crop, out->mutable_crop());
  for (const LayerSpec& layer : settings.layers) {
    v1::LayerSpec* wire = out->add_layers();
    wire->set_name(layer.name);
    wire->set_channels(layer.channels);
    wire->set_kind(code_of(kLayerKinds, layer.kind));
  }
  out->set_meters(settings.meters);
  out->set_seed(settings.seed);
  out->set_method(settings.method);
  out->set_max_bounces(settings.max_bounces);
  out->set_renderer_version(settings.renderer_version);
}

Result<RenderSettings> from_wire(const v1::RenderSettings& settings) {
  LM_RETURN_IF_ERROR(check_length("settings.scene", settings.scene(), kMaxSceneBytes));
  LM_RETURN_IF_ERROR(check_length("settings.method", settings.method(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_length("settings.renderer_version", settings.renderer_version(), kMaxWireNameBytes));
  RenderSettings out;
  LM_ASSIGN_OR_RETURN(out.crop, from_wire(settings.crop()));
  LM_ASSIGN_OR_RETURN(out.layers, layers_from_wire(settings));
  LM_ASSIGN_OR_RETURN(out.assets, assets_from_wire(settings));
  out.scene = settings.scene();
  out.meters = settings.meters();
  out.width = settings.width();
  out.height = settings.height();
  out.seed = settings.seed();
  out.method = settings.method();
  out.max_bounces = settings.max_bounces();
  out.renderer_version = settings.renderer_version();
  LM_RETURN_IF_ERROR(check_grid(out));
  return out;
}

void to_wire(const Goal& goal, v1::Goal* out) {
  out->set_samples(goal.samples);
  out->set_seconds(goal.seconds);
  out->set_error(goal.error);
  out->set_adaptive(goal.adaptive);
}

Result<Goal> from_wire(const v1::Goal& goal) {
  const Goal out{
      .samples = goal.samples(), .seconds = goal.seconds(), .error = goal.error(), .adaptive = goal.adaptive()};
  LM_RETURN_IF_ERROR(check_goal(out));
  return out;
}

void to_wire(const JobSpec& spec, v1::JobSpec* out) {
  out->set_name(spec.name);
  out->set_owner(spec.owner);
  out->set_host(spec.host);
  out->set_parent(spec.parent.value);
  out->set_priority(spec.priority);
  to_wire(spec.goal, out->mutable_goal());
  to_wire(spec.settings, out->mutable_settings());
  out->set_audit_share(spec.audit_share);
  out->set_allow_mixed(spec.allow_mixed);
}

Result<JobSpec> from_wire(const v1::JobSpec& spec) {
  LM_RETURN_IF_ERROR(check_length("name", spec.name(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_length("owner", spec.owner(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_length("host", spec.host(), kMaxWireNameBytes));
  JobSpec out;
  out.name = spec.name();
  out.owner = spec.owner();
  out.host = spec.host();
  out.parent = JobId{spec.parent()};
  out.priority = spec.priority();
  if (spec.has_audit_share()) {
    LM_RETURN_IF_ERROR(check_audit_share(spec.audit_share()));
    out.audit_share = spec.audit_share();
  }
  out.allow_mixed = spec.allow_mixed();
  LM_ASSIGN_OR_RETURN(out.goal, from_wire(spec.goal()));
  LM_ASSIGN_OR_RETURN(out.settings, from_wire(spec.settings()));
  return out;
}

void to_wire(const MethodNotes& notes, v1::MethodNotes* out) {
  out->set_chosen(notes.chosen);
  out->mutable_reasons()->Assign(notes.reasons.begin(), notes.reasons.end());
  out->mutable_notices()->Assign(notes.notices.begin(), notes.notices.end());
  out->mutable_candidates()->Assign(notes.candidates.begin(), notes.candidates.end());
}

Result<MethodNotes> from_wire(const v1::MethodNotes& notes) {
  MethodNotes out;
  out.chosen = notes.chosen();
  LM_ASSIGN_OR_RETURN(out.reasons, texts_from_wire("method_notes.reasons", notes.reasons()));
  LM_ASSIGN_OR_RETURN(out.notices, texts_from_wire("method_notes.notices", notes.notices()));
  LM_ASSIGN_OR_RETURN(out.candidates, texts_from_wire("method_notes.candidates", notes.candidates()));
  return out;
}

void to_wire(const JobCounters& counters, v1::JobCounters* out) {
  out->set_results_merged(counters.results_merged);
  out->set_results_duplicate(counters.results_duplicate);
  out->set_leases_lost(counters.leases_lost);
  out->set_copies_leased(counters.copies_leased);
  out->set_non_finite(counters.non_finite);
  out->set_results_audited(counters.results_audited);
  out->set_nodes_dropped(counters.nodes_dropped);
}

JobCounters from_wire(const v1::JobCounters& counters) {
  return {.results_merged = counters.results_merged(),
          .results_duplicate = counters.results_duplicate(),
          .leases_lost = counters.leases_lost(),
          .copies_leased = counters.copies_leased(),
          .non_finite = counters.non_finite(),
          .results_audited = counters.results_audited(),
          .nodes_dropped = counters.nodes_dropped()};
}

void to_wire(const ErrorPoint& point, v1::ErrorPoint* out) {
  out->set_samples(point.samples);
  out->set_worker_seconds(point.worker_seconds);
  out->mutable_error()->set_rel_mse(point.rel_mse);
  out->mutable_error()->set_half_width(point.half_width);
}

ErrorPoint from_wire(const v1::ErrorPoint& point) {
  return {.samples = point.samples(),
          .worker_seconds = point.worker_seconds(),
          .rel_mse = point.error().rel_mse(),
          .half_width = point.error().half_width()};
}

void to_wire(const JobStatus& status, v1::Job* out) {
  const JobSpec& spec = status.spec;
  const RenderSettings& settings = spec.settings;
  out->set_id(status.id.value);
  out->set_name(spec.name);
  out->set_owner(spec.owner);
  out->set_host(spec.host);
  out->set_method(settings.method);
  if (status.method_notes != MethodNotes{}) {
    to_wire(status.method_notes, out->mutable_method_notes());
  }
  out->set_fingerprint_class(status.fingerprint_class);
  out->set_parent(spec.parent.value);
  out->set_state(to_wire(status.state));
  out->set_reason(status.reason);
  out->set_reached(to_wire(status.reached));
  out->set_priority(spec.priority);
  to_wire(spec.goal, out->mutable_goal());
  out->set_width(settings.width);
  out->set_height(settings.height);
  to_wire(settings.crop, out->mutable_crop());
  for (const LayerSpec& layer : settings.layers) {
    if (layer.name != kBeautyLayer) {
      out->add_layers(layer.name);
    }
  }
  out->set_seed(settings.seed);
  out->set_samples_done(status.samples_done);
  out->set_samples_wanted(status.samples_wanted);
  out->set_min_tile_samples(status.min_tile_samples);
  out->set_max_tile_samples(status.max_tile_samples);
  out->set_frame_samples(status.frame_samples);
  out->set_active_seconds(status.active_seconds);
  out->set_worker_seconds(status.worker_seconds);
  out->set_samples_per_second(status.samples_per_second);
  out->set_eta_seconds(status.eta_seconds);
  if (status.error.known) {
    out->mutable_error()->set_rel_mse(status.error.rel_mse);
    out->mutable_error()->set_half_width(status.error.half_width);
  }
  for (const ErrorPoint& point : status.history) {
    to_wire(point, out->add_history());
  }
  to_wire(status.counters, out->mutable_counters());
  out->set_audit_share(spec.audit_share);
  out->set_allow_mixed(spec.allow_mixed);
  out->set_results_unaudited(status.results_unaudited);
  out->set_one_identity(status.one_identity);
  out->set_audits_lost(status.audits_lost);
  out->set_submitted_unix_ms(status.submitted_unix_ms);
  out->set_finished_unix_ms(status.finished_unix_ms);
  if (status.render_digest != Sha256{}) {
    out->set_render_digest(digest_bytes(status.render_digest));
  }
  out->set_trace_id(hash_bytes(trace_id(spec.request_id)));
}

void to_wire(const JobSpec& spec, v1::SubmitJobRequest* out) {
  out->set_request_id(spec.request_id);
  to_wire(spec, out->mutable_job());
}

Result<JobSpec> from_wire(const v1::SubmitJobRequest& request) {
  LM_RETURN_IF_ERROR(check_length("request_id", request.request_id(), kMaxWireNameBytes));
  LM_RETURN_IF_ERROR(check_request_id(request.request_id()));
  LM_ASSIGN_OR_RETURN(JobSpec spec, from_wire(request.job()));
  spec.request_id = request.request_id();
  return spec;
}

}  // namespace lightmill

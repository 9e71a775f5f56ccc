// Submission of scenes and jobs.
#include "common/base/text.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/method_plan.h"
#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "server/access/call_limits.h"
#include "server/domain/job_figures.h"
#include "server/operations/handlers.h"
#include "server/operations/operation_call.h"

namespace lightmill::handlers {
namespace {

constexpr std::uint64_t kMiB = 1 << 20;
constexpr int kMaxDigests = 10'000;
constexpr std::size_t kMaxNoteBytes = 1000;  ///< of a reason or notice about a method; they name parts of the scene

/// From now on, assets of the job that no user sent count as the submitter's, such as textures that a worker found in
/// a scene's files.
Status take_assets(const JobSpec& spec, const Identity& submitter, AssetStore& assets) {
  for (const Sha256& asset : *spec.settings.assets) {
    const Status taken =
        assets.keep(asset) ? assets.attribute(asset, submitter.name, UserLimit::enforced) : not_found("");
    if (taken.code() == StatusCode::kNotFound) {
      return failed_precondition("asset {} is missing: upload it first", asset.hex());
    }
    LM_RETURN_IF_ERROR(taken);
  }
  return ok_status();
}

MeshSource small_meshes(const AssetStore& assets) {
  return {[&assets](const Sha256& digest) -> std::optional<std::string> {
    const Result<std::uint64_t> size = assets.size(digest);
    if (!size.ok() || *size > MeshSource::kMaxBytes) {
      return std::nullopt;
    }
    const auto reader = assets.open_asset(digest);
    Result<std::string> bytes = reader.ok() ? (*reader)->next(MeshSource::kMaxBytes) : reader.status();
    return bytes.ok() && bytes->size() == *size ? std::optional(std::move(*bytes)) : std::nullopt;
  }};
}

/// Replaces `auto` in the settings by a method, or names the candidates of a pilot. For an adaptive job, a single
/// candidate too gets a pilot, which allocates samples. The notes have the reasons, and the light of the scene that the
/// method misses. `assets` has the assets of the scene; reads small meshes of them. INVALID_ARGUMENT if the scene is
/// damaged. A scene for another renderer version may only look so: its worker reads it, unless the choice needs it.
Result<MethodNotes> settle_method(JobSpec& spec, const AssetStore& assets) {
  RenderSettings& settings = spec.settings;
  const Result<MethodSpec> asked = parse_method(settings.method);
  MethodNotes notes;
  if (!asked.ok()) {
    return notes;  // Coordinator::submit refuses it
  }
  notes.chosen = asked->name == kAutoMethod;
  const Result<Scene> scene = unpack_scene(*settings.scene);
  if (!scene.ok()) {
    const bool needed = notes.chosen || spec.goal.adaptive || settings.renderer_version == kRendererVersion;
    return needed ? Result<MethodNotes>(with_context(scene.status(), "settings.scene")) : std::move(notes);
  }
  const SceneFacts facts = read_facts(*scene, small_meshes(assets));
  MethodPlan plan = plan_method(facts, settings.method);
  notes.reasons = std::move(plan.reasons);
  notes.notices =
      method_notices(facts, plan.candidates.front());  // if there are several candidates, each finds all light
  if (plan.candidates.size() == 1) {
    settings.method = std::move(plan.candidates.front());
    if (spec.goal.adaptive) {
      notes.candidates = {settings.method};
    }
  } else {
    notes.candidates = std::move(plan.candidates);
  }
  for (std::vector<std::string>* texts : {&notes.reasons, &notes.notices}) {
    for (std::string& text : *texts) {
      text = cut_text(std::move(text), kMaxNoteBytes);
    }
  }
  return notes;
}

/// Adds the layer `bias` to the film of a job with an error goal, if a method that it may get gathers photons.
void add_bias_layer(JobSpec& spec, const MethodNotes& notes) {
  RenderSettings& settings = spec.settings;
  if (spec.goal.error == 0 || NodeLayout(settings.layers).bias >= 0 || !may_gather(settings, notes)) {
    return;
  }
  std::vector<std::string> names{std::string(kBiasLayer)};
  for (const LayerSpec& layer : settings.layers) {
    names.push_back(layer.name);
  }
  // Coordinator::submit refuses layers that are not in order.
  if (Result<std::vector<LayerSpec>> layers = film_layers(names); layers.ok() && check_layers(settings.layers).ok()) {
    settings.layers = *std::move(layers);
  }
}

}  // namespace

void fill_defaults(v1::RenderSettings& settings) {
  if (!settings.has_crop()) {
    settings.mutable_crop()->set_width(settings.width());
    settings.mutable_crop()->set_height(settings.height());
  }
  if (settings.layers().empty()) {
    const LayerSpec beauty;
    v1::LayerSpec& layer = *settings.add_layers();
    layer.set_name(beauty.name);
    layer.set_channels(beauty.channels);
    layer.set_kind(v1::LayerSpec::SUMMED);
  }
  if (settings.method().empty()) {
    settings.set_method(std::string(kAutoMethod));
  }
  if (settings.renderer_version().empty()) {
    settings.set_renderer_version(kRendererVersion);
  }
}

Status check_files(const InspectionRequest& request, const AssetStore& assets) {
  std::uint64_t bytes = 0;
  for (const InspectionRequest::File& file : request.files) {
    const Result<std::uint64_t> size = assets.keep(file.digest) ? assets.size(file.digest) : not_found("");
    if (!size.ok()) {
      return failed_precondition("{}: asset {} is missing: upload it first", printable(file.path), file.digest.hex());
    }
    bytes += *size;
  }
  return bytes <= kMaxInspectedBytes
             ? ok_status()
             : resource_exhausted(
                   "the {} files have {} MiB, more than the {} that one inspection may read: `lightmill submit` "
                   "reads them where they are",
                   request.files.size(), bytes >> 20, kMaxInspectedBytes >> 20);
}

namespace {

Status find_missing_assets(Runtime& runtime, const v1::FindMissingAssetsRequest& request,
                           v1::FindMissingAssetsResponse* reply) {
  if (request.digests_size() > kMaxDigests) {
    return invalid_argument("digests: {} are more than the limit of {}", request.digests_size(), kMaxDigests);
  }
  for (const std::string& bytes : request.digests()) {
    const Result<Sha256> digest = digest_from_bytes(bytes);
    if (!digest.ok()) {
      return with_context(digest.status(), "digests");
    }
    if (!runtime.assets().keep(*digest)) {
      reply->add_missing(bytes);
    }
  }
  return ok_status();
}

Result<Apply> inspect_scene(Runtime& runtime, const Call&, v1::InspectSceneRequest& request,
                            v1::InspectSceneResponse* reply) {
  LM_ASSIGN_OR_RETURN(InspectionRequest files, from_wire(request));
  LM_RETURN_IF_ERROR(check_files(files, runtime.assets()));
  return Apply([files = std::move(files), reply](OperationContext& operation) {
    const auto found = [reply, answer = operation.pending.answer_later()](const auto& inspection) {
      if (inspection.ok()) {
        to_wire(**inspection, reply);
      }
      answer(inspection.status());
    };
    const Result<InspectionId> id =
        operation.context.inspect(caller_key(operation.call.caller, operation.call.peer), files, found);
    if (id.ok()) {
      operation.pending.on_cancel([id = *id](FarmLoop::TaskContext& context) { context.forget_inspection(id); });
    }
    return id.status();
  });
}

/// Takes the assets and chooses the method on the caller's thread. Then submits the job as the caller's.
Result<Apply> submit_job(Runtime& runtime, const Call& by, v1::SubmitJobRequest& request, v1::Job* reply) {
  if (request.job().has_settings()) {
    fill_defaults(*request.mutable_job()->mutable_settings());
  }
  LM_ASSIGN_OR_RETURN(JobSpec spec, from_wire(request));
  v1::SubmitJobRequest().Swap(&request);  // frees the request, which may be large
  LM_RETURN_IF_ERROR(take_assets(spec, by.caller, runtime.assets()));
  LM_ASSIGN_OR_RETURN(MethodNotes notes, settle_method(spec, runtime.assets()));
  add_bias_layer(spec, notes);
  return Apply([spec = std::move(spec), notes = std::move(notes), reply](OperationContext& operation) mutable {
    const Call& call = operation.call;
    FarmLoop::TaskContext& context = operation.context;
    if (call.caller.is_known()) {
      spec.owner = call.caller.name;
    }
    const AccessControl& access = operation.runtime.access();
    spec.ends_with_page = call.on_submitted != nullptr;
    if (spec.ends_with_page && !access.check_priority(call.caller, spec.priority).ok()) {
      spec.priority = access.user_priority();  // a page goes one above the job that it shows
    }
    operation.about.was_there = context.farm.knows_request(spec.request_id);
    if (!operation.about.was_there) {
      LM_RETURN_IF_ERROR(access.check_priority(call.caller, spec.priority));
    }
    if (!context.no_space.empty() && !operation.about.was_there) {
      return resource_exhausted("the farm takes no new jobs: it {}", context.no_space);
    }
    LM_ASSIGN_OR_RETURN(const JobId job,
                        context.farm.submit(spec, context.now, context.unix_ms, context.effects, notes));
    if (call.caller.is_known() && context.farm.owner(job).value_or("") != call.caller.name) {
      return already_exists("request_id '{}' belongs to a job of another user: choose another", spec.request_id);
    }
    operation.about.job = job.value;
    operation.about.text = spec.name;
    operation.about.change = fmt::format("submitted: {}, priority {}", describe(spec.goal), spec.priority);
    if (call.on_submitted) {
      call.on_submitted(job);
    }
    LM_ASSIGN_OR_RETURN(const JobStatus status, context.farm.status(job, context.now));
    to_wire(status, reply);
    return ok_status();
  });
}

/// JSON has all fields of an entry, also those that have their default.
std::uint64_t scene_json_bytes(const WireMessage& reply) {
  constexpr std::uint64_t kOfEntry = 4096;
  return kOfEntry * count_entries(static_cast<const v1::InspectSceneResponse&>(reply).packed());
}

Status fill_scene_json(WireMessage& reply) {
  return fill_scene(&static_cast<v1::InspectSceneResponse&>(reply));
}

}  // namespace

std::vector<Operation> submission_operations() {
  return {
      // A packed scene of 16 MiB and 10,000 assets in base64. The next two: most digests, most files.
      {{kRenderService, "SubmitJob", Right::submit, kRecorded},
       "POST jobs",
       in_two_steps(submit_job),
       {.most_body_bytes = 24 * kMiB}},
      {{kRenderService, "FindMissingAssets", Right::upload_assets},
       "POST assets/missing",
       at_once(find_missing_assets),
       {.most_body_bytes = kMiB}},
      // The reply has the scene as JSON, whose numbers take several times their bytes, and in base64.
      {{kRenderService, "InspectScene", Right::submit},
       "POST inspect",
       in_two_steps(inspect_scene),
       {.waits = true,
        .most_body_bytes = 4 * kMiB,
        .json_factor = 6,
        .more_json = scene_json_bytes,
        .fill_json = fill_scene_json}},
  };
}

}  // namespace lightmill::handlers

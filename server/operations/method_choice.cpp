#include "server/operations/method_choice.h"

#include "common/methods/spec/method_spec.h"
#include "common/planner/method_plan.h"
#include "common/wire/scene_proto.h"

namespace lightmill {
namespace {

MeshSource small_meshes(const AssetStore& assets) {
  return {[&assets](const Sha256& digest) -> std::optional<std::string> {
    const Result<std::uint64_t> size = assets.size(digest);
    if (!size.ok() || *size > MeshSource::kMostBytes) {
      return std::nullopt;
    }
    const auto reader = assets.open_asset(digest);
    Result<std::string> bytes = reader.ok() ? (*reader)->next(MeshSource::kMostBytes) : reader.status();
    return bytes.ok() && bytes->size() == *size ? std::optional(std::move(*bytes)) : std::nullopt;
  }};
}

}  // namespace

Result<MethodNotes> settle_method(JobSpec& spec, const AssetStore& assets) {
  RenderSettings& settings = spec.settings;
  const Result<MethodSpec> asked = parse_method(settings.method);
  MethodNotes notes;
  if (!asked.ok()) {
    return notes;  // Coordinator::submit refuses it
  }
  notes.chosen = asked->name == kAutoMethod;
  const Result<Scene> scene = unpack_scene(settings.scene);
  if (!scene.ok()) {
    return notes.chosen || spec.goal.adaptive ? Result<MethodNotes>(with_context(scene.status(), "settings.scene"))
                                              : std::move(notes);
  }
  const SceneFacts facts = read_facts(*scene, small_meshes(assets));
  MethodPlan plan = plan_method(facts, settings.method);
  notes.reasons = std::move(plan.reasons);
  notes.notices =
      method_notices(facts, plan.candidates.front());  // if there are several candidates, each finds all of the light
  if (plan.candidates.size() == 1) {
    settings.method = std::move(plan.candidates.front());
    if (spec.goal.adaptive) {
      notes.candidates = {settings.method};
    }
  } else {
    notes.candidates = std::move(plan.candidates);
  }
  return notes;
}

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

}  // namespace lightmill

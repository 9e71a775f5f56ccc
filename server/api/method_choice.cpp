#include "server/api/method_choice.h"

#include "common/methods/spec/method_spec.h"
#include "common/planner/method_plan.h"
#include "common/wire/scene_proto.h"

namespace lightmill {

Result<MethodNotes> settle_method(RenderSettings& settings) {
  const Result<MethodSpec> asked = parse_method(settings.method);
  MethodNotes notes;
  if (!asked.ok()) {
    return notes;  // the coordinator refuses it
  }
  notes.chosen = asked->name == kAutoMethod;
  const Result<Scene> scene = unpack_scene(settings.scene);
  if (!scene.ok()) {
    return notes.chosen ? Result<MethodNotes>(with_context(scene.status(), "settings.scene")) : std::move(notes);
  }
  const SceneFacts facts = read_facts(*scene);
  MethodPlan plan = plan_method(facts, settings.method);
  notes.reasons = std::move(plan.reasons);
  notes.notices = method_notices(facts, plan.candidates.front());  // several find all of the light, each of them
  if (plan.candidates.size() == 1) {
    settings.method = std::move(plan.candidates.front());
  } else {
    notes.candidates = std::move(plan.candidates);
  }
  return notes;
}

}  // namespace lightmill

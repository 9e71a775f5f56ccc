#include "common/farm/job_rules.h"

#include <cmath>

#include "common/base/text.h"
#include "common/film/allocation.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill {
namespace {

/// Whether the job can be rendered by this method.
Status check_method(std::string_view text, const RenderSettings& settings) {
  LM_ASSIGN_OR_RETURN(const MethodSpec method, with_context(parse_method(text), "settings.method"));
  if (method.name == kAutoMethod) {
    return invalid_argument("settings.method: {} has no candidate methods", text);
  }
  LM_RETURN_IF_ERROR(with_context(check_max_bounces(method.name, settings.max_bounces), "settings.max_bounces"));
  LM_RETURN_IF_ERROR(with_context(check_method_layers(method.name, settings.layers), "settings.layers"));
  if (settings.meters > 0 && !method_reads_meters(method.name)) {
    return invalid_argument("settings.meters: method {} reads none, got {}", text, settings.meters);
  }
  return ok_status();
}

}  // namespace

bool method_has_error(std::string_view method) {
  return method.substr(0, method.find(':')) != "photon-map";
}

Status check_method_error(std::string_view method, double error) {
  return error == 0 || method_has_error(method)
             ? ok_status()
             : invalid_argument(
                   "method {} has no error estimate, because all its samples show the same photons: give samples or "
                   "seconds",
                   method);
}

Status check_request_id(std::string_view id) {
  return id.empty() ? invalid_argument("request_id: must not be empty") : ok_status();
}

Status check_goal_seconds(double seconds) {
  return seconds > 0 && seconds <= kMaxGoalSeconds
             ? ok_status()
             : invalid_argument("must be more than 0 and at most {}, got {}", kMaxGoalSeconds, seconds);
}

Status check_goal_error(double error) {
  return error >= kMinGoalError && std::isfinite(error)
             ? ok_status()
             : invalid_argument("must be finite and at least {:g}, got {}", kMinGoalError, error);
}

std::uint64_t most_samples(const Goal& goal) {
  return kMaxSamples >> (goal.adaptive ? Allocation::kMaxDoublings : 0);
}

Status check_goal(const Goal& goal) {
  if (goal.samples > most_samples(goal)) {
    return invalid_argument("goal.samples: must be at most {}, got {}", most_samples(goal), goal.samples);
  }
  if (goal.seconds != 0) {
    LM_RETURN_IF_ERROR(with_context(check_goal_seconds(goal.seconds), "goal.seconds"));
  }
  return goal.error != 0 ? with_context(check_goal_error(goal.error), "goal.error") : ok_status();
}

Status check_goal(const Goal& goal, const PixelRect& crop) {
  if (goal.samples == 0 && goal.seconds == 0 && goal.error == 0) {
    return invalid_argument("goal: a job needs a limit, in samples, in seconds or in error");
  }
  LM_RETURN_IF_ERROR(check_goal(goal));
  if (goal.error > 0 && crop.width == 1 && crop.height == 1) {
    return invalid_argument("goal.error: a single pixel has no error estimate: give samples or seconds");
  }
  return ok_status();
}

Status check_audit_share(double share) {
  return share >= 0 && share <= 1 ? ok_status() : invalid_argument("audit_share: must be from 0 to 1, got {}", share);
}

Status check_crop(int width, int height, const PixelRect& crop) {
  if (!is_film_side(width) || !is_film_side(height)) {
    return invalid_argument("settings: width and height must be 1 to {}, got {}x{}", kMaxFilmSide, width, height);
  }
  const bool fits = crop.x >= 0 && crop.y >= 0 && crop.width > 0 && crop.height > 0 && crop.width <= width - crop.x &&
                    crop.height <= height - crop.y;
  return fits ? ok_status()
              : invalid_argument("settings.crop: {},{} {}x{} does not lie within {}x{} pixels", crop.x, crop.y,
                                 crop.width, crop.height, width, height);
}

Status check_grid(const RenderSettings& settings) {
  LM_RETURN_IF_ERROR(check_crop(settings.width, settings.height, settings.crop));
  return settings.meters <= kMaxMeters
             ? ok_status()
             : invalid_argument("settings.meters: must be at most {}, got {}", kMaxMeters, settings.meters);
}

Status check_film(const RenderSettings& settings) {
  LM_RETURN_IF_ERROR(check_grid(settings));
  return with_context(check_layers(settings.layers), "settings.layers");
}

Status check_spec(const JobSpec& spec, std::span<const std::string> candidates) {
  const RenderSettings& settings = spec.settings;
  LM_RETURN_IF_ERROR(check_name("name", spec.name));
  LM_RETURN_IF_ERROR(check_name("owner", spec.owner));
  LM_RETURN_IF_ERROR(check_name("host", spec.host));
  LM_RETURN_IF_ERROR(check_name("settings.renderer_version", settings.renderer_version));
  LM_RETURN_IF_ERROR(check_goal(spec.goal, settings.crop));
  LM_RETURN_IF_ERROR(check_audit_share(spec.audit_share));
  LM_RETURN_IF_ERROR(check_film(settings));
  for (const std::string& method : candidates) {
    LM_RETURN_IF_ERROR(check_method(method, settings));
  }
  if (candidates.empty()) {
    LM_RETURN_IF_ERROR(check_method(settings.method, settings));
  }
  LM_RETURN_IF_ERROR(with_context(check_method_error(settings.method, spec.goal.error), "goal.error"));
  if (settings.renderer_version.empty()) {
    return invalid_argument("settings.renderer_version: must not be empty");
  }
  return ok_status();
}

}  // namespace lightmill

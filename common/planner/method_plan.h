// Choice of a job's method: which methods find all of a scene's light, and which one to use.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/planner/scene_facts.h"

namespace lightmill {

/// Assessment of a method for a scene.
struct Verdict {
  std::string method;
  bool admitted = false;  ///< it finds all light
  std::string reason;     ///< why not, or why `auto` does not take it; may be empty
  std::string finder{};   ///< what finds the missing light: a method, "ppm alone" or "no method". Empty: not known
};

/// `method`: as jobs write it, with or without parameters. Light that no cheap and reliable test excludes is assumed to
/// exist. For example, a light that only seems to shine on glass counts.
Verdict admit(const SceneFacts& facts, std::string_view method);
/// Of all methods.
std::vector<Verdict> admit_all(const SceneFacts& facts);

/// Result of planning: the methods for a job.
struct MethodPlan {
  /// At least one method, with parameters, simplest first. A pilot chooses among several (common/planner/pilot.h).
  std::vector<std::string> candidates;
  std::vector<std::string> reasons;  ///< why these; only for `auto`
};

/// `asked`: as jobs write it. Parameters of `auto` are passed to the chosen method.
MethodPlan plan_method(const SceneFacts& facts, std::string_view asked);

/// Notices for users: the light that a picture by this method lacks (none if the method shows no light), and the meters
/// that it does not measure.
std::vector<std::string> method_notices(const SceneFacts& facts, std::string_view method);

}  // namespace lightmill

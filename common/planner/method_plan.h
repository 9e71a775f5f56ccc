// Which methods find all of a scene's light, and which of them a job is to use.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/planner/scene_facts.h"

namespace lightmill {

/// What there is to say of a method for a scene.
struct Verdict {
  std::string method;
  bool admitted = false;  ///< it finds all of the light
  std::string reason;     ///< why not, or why `auto` passes it over all the same; may be empty
};

/// `method` as jobs write it, with or without parameters. What no cheap and sound test excludes is taken to be there: a
/// lamp that only seems to shine on glass counts.
Verdict admit(const SceneFacts& facts, std::string_view method);
/// Of every method that there is.
std::vector<Verdict> admit_all(const SceneFacts& facts);

/// How a job comes by its method.
struct MethodPlan {
  /// At least one, with parameters, the simplest first; of several a pilot picks one (common/planner/pilot.h).
  std::vector<std::string> candidates;
  std::vector<std::string> reasons;  ///< why those; of `auto` alone
};

/// `asked` as jobs write it. Parameters of `auto` are handed on to what it picks.
MethodPlan plan_method(const SceneFacts& facts, std::string_view asked);

/// What of the scene's light a picture by this method lacks (methods that show no light lack nothing), and what its
/// meters do not tell, for whoever sees it.
std::vector<std::string> method_notices(const SceneFacts& facts, std::string_view method);

}  // namespace lightmill

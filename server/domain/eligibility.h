// Eligibility: which workers may render which jobs.
#pragma once

#include "server/domain/job.h"
#include "server/domain/worker_registry.h"

namespace lightmill {

/// Whether results of such workers can enter the job's film.
inline bool suits(std::string_view fingerprint_class, std::string_view renderer_version, const Job& job) {
  const std::string& fixed = job.record().fingerprint_class;
  return (job.spec().allow_mixed || fixed.empty() || fixed == fingerprint_class) &&
         job.spec().settings.renderer_version == renderer_version;
}
inline bool suits(const Worker& worker, const Job& job) {
  return suits(worker.hello().fingerprint_class, worker.hello().renderer_version, job);
}

inline bool may_render(const Worker& worker, const Job& job) {
  return !worker.quarantined() && suits(worker, job) && !worker.too_large().contains(job.id()) &&
         !job.refusals().excludes(worker.identity());
}
/// Whether the worker may get work of the job now.
inline bool may_have(const Worker& worker, const Job& job, Time now) {
  return now >= job.held_until() && may_render(worker, job) &&
         now >= job.refusals().may_have_from(worker.identity(), worker.connected_at());
}

/// The worker as the renderer of a result of this job.
inline Renderer renderer_of(const Worker& worker, const Job& job) {
  return {worker.name(), identity_of(worker.hello()), job.class_of_result(worker.hello().fingerprint_class)};
}

}  // namespace lightmill

// A render job as plain values: its settings, goal and status.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/clock.h"
#include "common/base/digest.h"
#include "common/base/ids.h"
#include "common/base/shared.h"
#include "common/film/layers.h"
#include "common/film/tile_grid.h"

namespace lightmill {

/// Everything that decides the samples, except the fingerprint class.
struct RenderSettings {
  Shared<std::string> scene;           ///< the scene document: lightmill.v1.Scene, deterministically serialised
  Shared<std::vector<Sha256>> assets;  ///< the assets of the scene, sorted, each once
  int width = 0;                       ///< full film, pixels
  int height = 0;
  PixelRect crop;                              ///< the part that is rendered
  std::vector<LayerSpec> layers{LayerSpec{}};  ///< as film_layers gives them
  std::uint32_t meters = 0;                    ///< number of the scene's meters
  std::uint64_t seed = 0;
  std::string method = "path";
  std::uint32_t max_bounces = 0;  ///< only for methods with method_bounces(); 0: the method's own limit
  std::string renderer_version;   ///< of the program that takes the request; see kRendererVersion
};

/// The film's tiles.
inline TileGrid grid_of(const RenderSettings& settings) {
  return TileGrid(settings.crop, settings.meters);
}

/// Version of the samples' bits. It is raised whenever any sample's bits, or the names of fingerprint classes, change.
inline constexpr const char* kRendererVersion = "lightmill-core-23";

/// The class of a job whose samples workers of any class may render. No worker has it.
inline constexpr const char* kMixedClass = "mixed";

/// The render digest: SHA-256 of `settings` and the class. It covers everything that decides a sample, except the
/// workers' rounding if the class is kMixedClass.
Sha256 render_digest(const RenderSettings& settings, const std::string& fingerprint_class);

/// About 30 years, far below the range of the clock's 64-bit nanoseconds.
inline constexpr double kMaxGoalSeconds = 1e9;
inline constexpr double kMinGoalError = 1e-12;  ///< the least relMSE that single precision can tell from 0

/// Limits of a job. At least one is set. The job ends at the first that it reaches.
struct Goal {
  std::uint64_t samples = 0;  ///< per pixel; 0: no limit
  double seconds = 0;         ///< rendering time without pauses; 0: no limit
  double error = 0;           ///< relMSE of the frame with its confidence interval; 0: no limit
  bool adaptive = false;      ///< `samples` is the frame's mean; noisy tiles get more (Allocation)
  friend bool operator==(const Goal&, const Goal&) = default;
};

/// The limit that ended a job.
enum class GoalLimit { none, samples, seconds, error };

enum class JobState { queued, running, paused, done, failed, cancelled };

inline constexpr std::array kJobStates{JobState::queued, JobState::running, JobState::paused,
                                       JobState::done,   JobState::failed,  JobState::cancelled};
/// "queued", "running", …
std::string_view name_of(JobState state);

inline bool has_ended(JobState state) {
  return state == JobState::done || state == JobState::failed || state == JobState::cancelled;
}

/// Reasons for the choice of a job's method, and notices about it. Not part of the render digest.
struct MethodNotes {
  bool chosen = false;               ///< the client asked for `auto`; else by name
  std::vector<std::string> reasons;  ///< why it was chosen
  std::vector<std::string> notices;  ///< light of the scene that the picture lacks
  /// Methods from which a pilot still has to choose. There is only one if the pilot just allocates samples. Empty after
  /// the pilot. Until then the settings name `auto`, or the only method.
  std::vector<std::string> candidates;
  friend bool operator==(const MethodNotes&, const MethodNotes&) = default;
};

/// Whether the method, or one that a pilot may choose, gathers photons, which blurs (method_gathers).
bool may_gather(const RenderSettings& settings, const MethodNotes& notes);

/// The default share of results that are audited: another identity renders them again.
inline constexpr double kAuditShare = 0.01;

/// A job as a client submits it. Only goal and priority change later.
struct JobSpec {
  std::string request_id;  ///< two submissions with one id are one job
  std::string name;
  /// User name from the client; the authenticated caller's name, if callers authenticate.
  std::string owner;
  std::string host;                  ///< host of the client
  JobId parent;                      ///< 0: none
  std::int32_t priority = 0;         ///< higher goes first
  double audit_share = kAuditShare;  ///< share of audited results, 0 to 1
  /// Workers of any class may render it. If their rounding differs, the bits cannot be reproduced.
  bool allow_mixed = false;
  bool ends_with_page = false;  ///< it is deleted once the page that submitted it has gone; never true over gRPC
  Goal goal;
  RenderSettings settings;
};

/// Counters of a job's results and leases. They show whether anything was rendered needlessly.
struct JobCounters {
  std::uint64_t results_merged = 0;     ///< nodes that entered the film
  std::uint64_t results_duplicate = 0;  ///< nodes that were already covered, and were dropped
  std::uint64_t leases_lost = 0;        ///< leases that expired or whose worker left
  std::uint64_t copies_leased = 0;      ///< tiles leased a second time near the end
  std::uint64_t non_finite = 0;         ///< samples that counted as zero
  std::uint64_t results_audited = 0;    ///< results whose audit gave the same bits
  std::uint64_t nodes_dropped = 0;      ///< nodes dropped from the film, because a worker with a part in them was wrong
};

/// The frame's error, if it is known.
struct ErrorEstimate {
  double rel_mse = 0;     ///< mean over pixels and channels of var/(r²+0.01)
  double half_width = 0;  ///< 95 % confidence: rel_mse ± half_width; see FrameError
  bool known = false;     ///< false until every tile has both halves
};

/// The frame's error at a number of samples.
struct ErrorPoint {
  double samples = 0;         ///< per pixel, the mean over the frame
  double worker_seconds = 0;  ///< as in JobStatus
  double rel_mse = 0, half_width = 0;
  friend bool operator==(const ErrorPoint&, const ErrorPoint&) = default;
};

/// The current state of a job.
struct JobStatus {
  JobId id;
  JobSpec spec;                   ///< with the current goal, priority and method; without scene and assets
  std::string fingerprint_class;  ///< empty until fixed; kMixedClass if all classes are allowed
  MethodNotes method_notes;
  JobState state = JobState::queued;
  std::string reason;                   ///< why it failed, which limit ended it, or what it waits for
  GoalLimit reached = GoalLimit::none;  ///< only for a done job
  std::uint64_t samples_done = 0;       ///< pixel samples merged
  std::uint64_t samples_wanted = 0;     ///< pixel samples at the sample goal; 0 without one
  std::uint64_t min_tile_samples = 0, max_tile_samples = 0;  ///< per pixel
  std::uint64_t frame_samples = 0;                           ///< per pixel: every tile has its share of this many
  double active_seconds = 0;                                 ///< time in which it was rendered
  double worker_seconds = 0;                                 ///< sum of the workers' thread seconds over all results
  double samples_per_second = 0;                             ///< recent rate, pixel samples
  double eta_seconds = -1;                                   ///< negative: unknown
  ErrorEstimate error;
  /// Ascending: at about 2^k and 3·2^k samples per pixel, once every tile has 16, and at the end.
  std::vector<ErrorPoint> history;
  JobCounters counters;
  bool one_identity = false;            ///< results wait for an audit, but no other identity or machine is connected
  std::uint64_t results_unaudited = 0;  ///< results that still wait for an audit, or, at the end, could not have one
  std::uint64_t audits_lost = 0;        ///< of these, results whose audit an identity lost repeatedly
  std::int64_t submitted_unix_ms = 0, finished_unix_ms = 0;  ///< 0: not yet
  Sha256 render_digest;                                      ///< zero until the class is fixed
};

/// The id of a job in the logs of all programs. It is the request id if that has 32 hexadecimal digits, as those of our
/// clients have. Else it is a digest of the request id.
Hash128 trace_id(const std::string& request_id);

}  // namespace lightmill

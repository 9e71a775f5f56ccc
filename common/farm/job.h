// What a job is, as plain values: said by clients, kept by the coordinator, shown to everybody.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/digest.h"
#include "common/base/ids.h"
#include "common/film/layers.h"
#include "common/film/tile_grid.h"

namespace lightmill {

/// All that decides the samples but for the fingerprint class.
struct RenderSettings {
  std::string scene;           ///< the scene document: lightmill.v1.Scene, deterministically serialised
  std::vector<Sha256> assets;  ///< those that the scene names, sorted, each once
  int width = 0;               ///< of the full film, pixels
  int height = 0;
  PixelRect crop;                              ///< what is rendered
  std::vector<LayerSpec> layers{LayerSpec{}};  ///< as film_layers gives them
  std::uint32_t meters = 0;                    ///< how many the scene has
  std::uint64_t seed = 0;
  std::string method = "path";
  std::uint32_t max_bounces = 0;  ///< of `path`, `caustic` and `whitted`; 0: the method's own limit
  std::string renderer_version;   ///< of the program that was asked to render; see kRendererVersion
};

/// The film's tiles.
inline TileGrid grid_of(const RenderSettings& settings) {
  return TileGrid(settings.crop, settings.meters);
}

/// Bumped whenever any sample's bits change.
inline constexpr const char* kRendererVersion = "lightmill-core-10";

/// Stands for the class of a job whose samples workers of any class may render; no worker's own.
inline constexpr const char* kMixedClass = "mixed";

/// The render digest: SHA-256 of `settings` and the class. Everything that decides a sample is in it, but for how
/// workers round where the class is kMixedClass.
Sha256 render_digest(const RenderSettings& settings, const std::string& fingerprint_class);

/// Some thirty years: far below what the clock's 64 bits of nanoseconds hold.
inline constexpr double kMaxGoalSeconds = 1e9;
inline constexpr double kLeastGoalError = 1e-12;  ///< relMSE that single precision can tell from none

/// A job ends at the first limit that is set; at least one is.
struct Goal {
  std::uint64_t samples = 0;  ///< per pixel; 0: no limit
  double seconds = 0;         ///< of rendering, pauses excluded; 0: no limit
  double error = 0;           ///< of the frame, relMSE with its confidence interval; 0: no limit
  bool adaptive = false;  ///< samples are those of the frame on average: tiles' parts go by their noise (Allocation)
  friend bool operator==(const Goal&, const Goal&) = default;
};

/// Which of its limits ended a job.
enum class GoalLimit { none, samples, seconds, error };

enum class JobState { queued, running, paused, done, failed, cancelled };

inline bool has_ended(JobState state) {
  return state == JobState::done || state == JobState::failed || state == JobState::cancelled;
}

/// How a job came by its method, and what is to be known of it. No part of the render digest.
struct MethodNotes {
  bool chosen = false;               ///< for the client who asked for `auto`; else asked for by name
  std::vector<std::string> reasons;  ///< of the choice
  std::vector<std::string> notices;  ///< what of the scene's light its picture lacks
  /// Methods of which a pilot is still to pick one, or the only one, if the pilot is but to say where samples go; empty
  /// once that is known. Until then the settings name `auto`, or the only one.
  std::vector<std::string> candidates;
  friend bool operator==(const MethodNotes&, const MethodNotes&) = default;
};

/// Whether the method, or one that a pilot may pick, gathers photons, which blurs (method_gathers).
bool may_gather(const RenderSettings& settings, const MethodNotes& notes);

/// Of the results, which are rendered again by another identity unless a job says otherwise.
inline constexpr double kVerifyShare = 0.01;

/// What a client submits. Immutable afterwards but for goal and priority.
struct JobSpec {
  std::string request_id;  ///< the same id submitted twice is one job
  std::string name;
  std::string owner;                   ///< who asked (a user name as the client gives it)
  std::string host;                    ///< where it was asked
  JobId parent;                        ///< 0: none
  std::int32_t priority = 0;           ///< higher goes first
  double verify_share = kVerifyShare;  ///< of the results that are rendered again by another identity, 0 to 1
  /// Workers of any class may render it: where their rounding differs, nobody gets the same bits again.
  bool allow_mixed = false;
  bool ends_with_page = false;  ///< it is deleted once the page that submitted it is gone; never of a job over gRPC
  Goal goal;
  RenderSettings settings;
};

/// Counters that let tests and people see that nothing was rendered needlessly.
struct JobCounters {
  std::uint64_t results_merged = 0;     ///< nodes that entered the film
  std::uint64_t results_duplicate = 0;  ///< nodes that were already covered, and dropped
  std::uint64_t leases_lost = 0;        ///< leases that expired or whose worker left
  std::uint64_t copies_leased = 0;      ///< tiles leased a second time near the end
  std::uint64_t non_finite = 0;         ///< samples that counted as zero
  std::uint64_t results_verified = 0;   ///< rendered again by another identity, with the same bits
  std::uint64_t nodes_dropped = 0;      ///< of the film, because a worker with a part in them was found to be wrong
};

/// The frame's error as far as it is known.
struct ErrorEstimate {
  double rel_mse = 0;     ///< mean over pixels and channels of var/(r²+0.01)
  double half_width = 0;  ///< 95 % confidence: rel_mse ± half_width; see FrameError
  bool known = false;     ///< false until every tile has both halves
};

/// The frame's error when a job had so many samples.
struct ErrorPoint {
  double samples = 0;         ///< per pixel, the mean over the frame
  double worker_seconds = 0;  ///< as JobStatus has it
  double rel_mse = 0, half_width = 0;
  friend bool operator==(const ErrorPoint&, const ErrorPoint&) = default;
};

/// A job as it stands.
struct JobStatus {
  JobId id;
  std::string name, owner, host, method;
  std::string fingerprint_class;  ///< empty until fixed; kMixedClass of one that allows all
  MethodNotes method_notes;
  JobId parent;
  JobState state = JobState::queued;
  std::string reason;                   ///< why it failed, which limit ended it, or what it waits for
  GoalLimit reached = GoalLimit::none;  ///< of a done job
  std::int32_t priority = 0;
  Goal goal;
  int width = 0, height = 0;
  PixelRect crop;
  std::vector<std::string> layers;  ///< besides beauty, in film order
  std::uint64_t seed = 0;
  std::uint64_t samples_done = 0;                            ///< pixel samples merged
  std::uint64_t samples_wanted = 0;                          ///< pixel samples at the sample goal; 0 without one
  std::uint64_t min_tile_samples = 0, max_tile_samples = 0;  ///< per pixel
  std::uint64_t frame_samples = 0;                           ///< per pixel: the most of which every tile has its part
  double active_seconds = 0;                                 ///< time during which it was being rendered
  double worker_seconds = 0;                                 ///< sum over results of the workers' own thread seconds
  double samples_per_second = 0;                             ///< recent rate, pixel samples
  double eta_seconds = -1;                                   ///< negative: unknown
  ErrorEstimate error;
  /// Ascending: where the frame had about 2^k and 3·2^k samples, from where every tile has 16 on, and at its end.
  std::vector<ErrorPoint> history;
  JobCounters counters;
  double verify_share = 0;
  bool allow_mixed = false;
  bool one_identity = false;  ///< results wait to be verified, and no other certificate, token or machine is here
  std::uint64_t results_unverified = 0;  ///< that are still to be verified, or, at the end, could not be
  std::int64_t submitted_unix_ms = 0, finished_unix_ms = 0;  ///< 0: not yet
  Sha256 render_digest;                                      ///< zero until the class is fixed
  Hash128 trace;                                             ///< trace_id of its request
};

/// Under which a job is found in the logs of all programs: its request id where that is 32 hexadecimal digits, as those
/// of our clients are, else a digest of it.
Hash128 trace_id(const std::string& request_id);

}  // namespace lightmill

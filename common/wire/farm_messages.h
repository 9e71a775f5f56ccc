// Conversion of jobs, units, nodes and the worker's stream between plain values and lightmill.v1.
//
// to_wire fills a message that must be empty. from_wire checks every size, count and range against limits.h, and names
// the wrong field. So its results are safe to use. Both are stateless.
#pragma once

#include "common/base/status.h"
#include "common/farm/job.h"
#include "common/farm/messages.h"

namespace lightmill::v1 {
class ErrorEstimate;
class ErrorPoint;
class Goal;
enum GoalLimit : int;
class Job;
class JobCounters;
enum JobState : int;
class MethodNotes;
class InspectGrant;
class InspectReport;
class InspectSceneRequest;
class InspectSceneResponse;
class HeldLease;
class JobSpec;
class LeaseGrant;
class NodeKey;
class PixelRect;
class RenderSettings;
class SampleRange;
class SubmitJobRequest;
class Unit;
class WorkRequest;
class WorkResponse;
}  // namespace lightmill::v1

namespace lightmill {

// ---- farm.proto ----

void to_wire(const PixelRect& rect, v1::PixelRect* out);
void to_wire(const RenderSettings& settings, v1::RenderSettings* out);
void to_wire(const Goal& goal, v1::Goal* out);
v1::JobState to_wire(JobState state);
v1::GoalLimit to_wire(GoalLimit limit);
void to_wire(const MethodNotes& notes, v1::MethodNotes* out);
void to_wire(const JobCounters& counters, v1::JobCounters* out);
void to_wire(const ErrorPoint& point, v1::ErrorPoint* out);
void to_wire(const JobSpec& spec, v1::JobSpec* out);  ///< without the request id, which is in SubmitJobRequest
void to_wire(const JobStatus& status, v1::Job* out);
void to_wire(const SampleRange& range, v1::SampleRange* out);
void to_wire(const NodeKey& key, v1::NodeKey* out);
void to_wire(const Unit& unit, v1::Unit* out);

Result<PixelRect> from_wire(const v1::PixelRect& rect);
Result<RenderSettings> from_wire(const v1::RenderSettings& settings);
Result<Goal> from_wire(const v1::Goal& goal);
Result<JobState> from_wire(v1::JobState state);
Result<GoalLimit> from_wire(v1::GoalLimit limit);
Result<MethodNotes> from_wire(const v1::MethodNotes& notes);
JobCounters from_wire(const v1::JobCounters& counters);
ErrorPoint from_wire(const v1::ErrorPoint& point);
Result<JobSpec> from_wire(const v1::JobSpec& spec);
Result<SampleRange> from_wire(const v1::SampleRange& range);
Result<NodeKey> from_wire(const v1::NodeKey& key);
Result<Unit> from_wire(const v1::Unit& unit);

// ---- render_service.proto ----

void to_wire(const JobSpec& spec, v1::SubmitJobRequest* out);
/// Fails without a request id.
Result<JobSpec> from_wire(const v1::SubmitJobRequest& request);

/// Without the document for people, which fill_scene adds.
void to_wire(const Inspection& inspection, v1::InspectSceneResponse* out);
/// Parses the packed scene into the field beside it.
Status fill_scene(v1::InspectSceneResponse* out);
Result<Inspection> from_wire(const v1::InspectSceneResponse& response);
void to_wire(const InspectionRequest& request, v1::InspectSceneRequest* out);
Result<InspectionRequest> from_wire(const v1::InspectSceneRequest& request);

// ---- worker_service.proto ----

void to_wire(const WorkerMessage& message, v1::WorkRequest* out);
void to_wire(const CoordinatorMessage& message, v1::WorkResponse* out);

void to_wire(const HeldLease& held, v1::HeldLease* out);
void to_wire(const LeaseGrant& grant, v1::LeaseGrant* out);
void to_wire(const InspectReport& report, v1::InspectReport* out);
void to_wire(const InspectGrant& grant, v1::InspectGrant* out);

Result<WorkerMessage> from_wire(const v1::WorkRequest& request);
Result<CoordinatorMessage> from_wire(const v1::WorkResponse& response);
Result<HeldLease> from_wire(const v1::HeldLease& held);
Result<LeaseGrant> from_wire(const v1::LeaseGrant& grant);
Result<InspectReport> from_wire(const v1::InspectReport& report);
Result<InspectGrant> from_wire(const v1::InspectGrant& grant);

}  // namespace lightmill

#include "server/web/job_intake.h"

#include <algorithm>
#include <array>

#include "common/wire/farm_messages.h"
#include "lightmill/v1/render_service.pb.h"
#include "server/operations/submission.h"
#include "server/web/web_change.h"

namespace lightmill {
namespace {

/// A packed scene of 16 MiB and 10,000 assets in base64; so many digests; so many files.
constexpr std::array<LargeCall, 3> kLargeCalls{{
    {"/api/v1/jobs", Rpc::submit_job, std::uint64_t{24} << 20},
    {"/api/v1/assets/missing", Rpc::find_missing_assets, std::uint64_t{1} << 20},
    {"/api/v1/inspect", Rpc::inspect_scene, std::uint64_t{4} << 20},
}};

}  // namespace

const LargeCall* find_large_call(std::string_view path) {
  const auto found = std::ranges::find(kLargeCalls, path, &LargeCall::path);
  return found == kLargeCalls.end() ? nullptr : &*found;
}

void JobIntake::submit(const Call& call, std::string_view page_name, LargeBody body, Reply reply) {
  const std::string page(page_name);
  std::function<void(JobId)> tell_page;
  if (!page.empty()) {
    if (const Status status = page_jobs_.check(page, call); !status.ok()) {
      return reply(error_reply(status));
    }
    tell_page = page_jobs_.told_by_others(page, call);
  }
  on_side_thread_([&desk = desk_, &gate = gate_, &assets = assets_, call, tell_page, body = std::move(body),
                   back = desk_.expect(std::move(reply))]() mutable {
    v1::SubmitJobRequest request;
    const Status read = read_json(body.text, request);
    body.text = {};
    Result<Submission> submission = read.ok() ? read_submission(request, assets) : read;
    if (!submission.ok()) {
      return back(error_reply(submission.status()));
    }
    submission->spec.ends_with_page = tell_page != nullptr;
    desk.run(back, [&gate, call, tell_page, submission = *std::move(submission), place = std::move(body.place)](
                       FarmLoop::Turn& turn, const FarmReply& back) mutable {
      make_change(turn, gate, call, back, [&](FarmLoop::Turn&, About& about) -> Result<ApiReply> {
        LM_RETURN_IF_ERROR(lightmill::submit(turn, call, submission, about));
        if (tell_page) {
          tell_page(JobId{about.job});
        }
        return job_reply(turn, JobId{about.job});
      });
    });
  });
}

void JobIntake::find_missing(LargeBody body, Reply reply) {
  on_side_thread_([&assets = assets_, body = std::move(body), back = desk_.expect(std::move(reply))] {
    v1::FindMissingAssetsRequest request;
    v1::FindMissingAssetsResponse response;
    Status status = read_json(body.text, request);
    if (status.ok()) {
      status = lightmill::find_missing(assets, request, &response);
    }
    back(status.ok() ? json_reply(response) : error_reply(status));
  });
}

void JobIntake::send_spec(const Call& call, JobId job, Reply reply) {
  desk_.ask(std::move(reply), [call, job, &gate = gate_, budget = budget_, on_side_thread = on_side_thread_](
                                  FarmLoop::Turn& turn, const FarmReply& back) {
    const Status status = check_job_call(turn, gate, call, job);
    const Result<const JobSpec*> spec = status.ok() ? turn.farm.spec(job) : status;
    if (!spec.ok()) {
      return back(error_reply(spec.status()));
    }
    // In base64, of which more than one copy is made on the way.
    ByteBudget::Place place = budget->take(holder_of(call.caller, call.peer), 2 * (*spec)->settings.scene.size());
    if (place == nullptr) {
      return back(error_reply(resource_exhausted("too many scenes are fetched at once: try again")));
    }
    const auto wire = std::make_shared<v1::JobSpec>();
    to_wire(**spec, wire.get());
    on_side_thread([wire, place, back] {
      ApiReply answer = json_reply(*wire);
      answer.file = placed_bytes(std::move(answer.body), place);
      back(std::move(answer));
    });
  });
}

}  // namespace lightmill

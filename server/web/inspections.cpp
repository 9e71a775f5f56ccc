// POST /api/v1/inspect: has a worker read scene files.
#include "common/wire/farm_messages.h"
#include "lightmill/v1/render_service.pb.h"
#include "server/access/call_limits.h"
#include "server/operations/submission.h"
#include "server/web/job_intake.h"

namespace lightmill {
namespace {

Result<InspectionRequest> read_request(const std::string& body) {
  v1::InspectSceneRequest wire;
  LM_RETURN_IF_ERROR(read_json(body, wire));
  return from_wire(wire);
}

ApiReply found_reply(const Inspection& found) {
  v1::InspectSceneResponse wire;
  to_wire(found, &wire);
  const Status status = fill_scene(&wire);
  return status.ok() ? json_reply(wire) : error_reply(status);
}

}  // namespace

void JobIntake::inspect(const Call& call, LargeBody body, Reply reply) {
  on_side_thread_([&desk = desk_, &assets = assets_, budget = budget_, on_side_thread = on_side_thread_,
                   caller = caller_key(call.caller, call.peer), holder = holder_of(call.caller, call.peer),
                   body = std::move(body), back = desk_.expect(std::move(reply))] {
    const Result<InspectionRequest> request = read_request(body.text);
    const Status status = request.ok() ? check_files(*request, assets) : request.status();
    if (!status.ok()) {
      return back(error_reply(status));
    }
    const auto told = [budget, holder, on_side_thread, back](const Result<std::shared_ptr<const Inspection>>& found) {
      if (!found.ok()) {
        return back(error_reply(found.status()));
      }
      // The scene as JSON, of which numbers take several times their bytes, and in base64.
      ByteBudget::Place place = budget->take(holder, 6 * (*found)->scene.size());
      if (place == nullptr) {
        return back(error_reply(resource_exhausted("too many scenes are fetched at once: try again")));
      }
      on_side_thread([found = *found, place, back] {
        ApiReply answer = found_reply(*found);
        answer.file = placed_bytes(std::move(answer.body), place);
        back(std::move(answer));
      });
    };
    desk.run(back, [caller, request = *request, told](FarmLoop::Turn& turn, const FarmReply& back) {
      const Result<InspectionId> id = turn.inspect(caller, request, told);
      if (!id.ok()) {
        back(error_reply(id.status()));
      }
    });
  });
}

}  // namespace lightmill

// Makers of handlers, and the tables of each subject. Private to server/operations.
#pragma once

#include <vector>

#include "externalscaler/externalscaler.pb.h"
#include "lightmill/v1/access_service.pb.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/web.pb.h"
#include "server/operations/operation.h"

namespace lightmill::handlers {

// Each file of a subject has its operations: handlers that read a request, ask the farm and write the reply, and below
// them a table with an entry for each.
std::vector<Operation> submission_operations();
std::vector<Operation> job_operations();
std::vector<Operation> worker_operations();
std::vector<Operation> history_operations();
std::vector<Operation> access_operations();

inline constexpr bool kRecorded = true;  ///< Rpc::recorded

template <class Request, class Reply>
Handler handler_of(std::function<Result<Apply>(Runtime&, const Call&, Request&, Reply*)> begin) {
  return {&Request::default_instance(), &Reply::default_instance(), [](const WireMessage&) { return CallSubject(); },
          false,
          [begin = std::move(begin)](Runtime& runtime, const Call& call, WireMessage& request, WireMessage& reply) {
            return begin(runtime, call, static_cast<Request&>(request), static_cast<Reply*>(&reply));
          }};
}

/// Runs only on the caller's thread.
template <class Request, class Reply>
Handler at_once(Status (*answer)(Runtime&, const Request&, Reply*)) {
  return handler_of<Request, Reply>(
      [answer](Runtime& runtime, const Call&, Request& request, Reply* reply) -> Result<Apply> {
        LM_RETURN_IF_ERROR(answer(runtime, request, reply));
        return Apply();
      });
}

/// Starts on the caller's thread, and ends on the farm thread.
template <class Request, class Reply>
Handler in_two_steps(Result<Apply> (*begin)(Runtime&, const Call&, Request&, Reply*)) {
  return handler_of<Request, Reply>(begin);
}

/// Runs on the farm thread.
template <class Request, class Reply>
Handler on_farm(Status (*apply)(OperationContext&, const Request&, Reply*)) {
  return handler_of<Request, Reply>([apply](Runtime&, const Call&, Request& request, Reply* reply) -> Result<Apply> {
    return Apply([apply, &request, reply](OperationContext& operation) { return apply(operation, request, reply); });
  });
}

/// Runs on the farm thread for the job whose id the request has, if the caller may use it.
template <class Request, class Reply>
Handler on_job(Status (*apply)(OperationContext&, const Request&, Reply*)) {
  Handler handler = on_farm(apply);
  handler.about = [](const WireMessage& request) { return CallSubject{static_cast<const Request&>(request).id()}; };
  handler.of_job = true;
  return handler;
}

/// Runs on the farm thread for a worker or token that a field of the request names.
template <class Request, class Reply>
Handler named(const std::string& (Request::*name)() const, Status (*apply)(OperationContext&, const Request&, Reply*)) {
  Handler handler = on_farm(apply);
  handler.about = [name](const WireMessage& request) {
    return CallSubject{0, (static_cast<const Request&>(request).*name)()};
  };
  return handler;
}

/// Limit for the files of one inspection together. A worker has them in memory beside the scenes that it renders.
inline constexpr std::uint64_t kMaxInspectedBytes = std::uint64_t{512} << 20;

/// Gives a submitted job what its sender left out: the whole film as crop, the layer beauty, the method auto, and the
/// renderer version of this program.
void fill_defaults(v1::RenderSettings& settings);

/// FAILED_PRECONDITION if a file is missing, RESOURCE_EXHAUSTED if they have too many bytes. Blocks on the disk.
Status check_files(const InspectionRequest& request, const AssetStore& assets);

}  // namespace lightmill::handlers

// Operation: one request message and one reply message, over gRPC, HTTP or both.
#pragma once

#include <google/protobuf/message.h>

#include <functional>
#include <span>
#include <string_view>

#include "server/runtime/runtime.h"

namespace lightmill {

class OperationCall;
using WireMessage = google::protobuf::Message;

/// Context of a call on the farm thread.
struct OperationContext {
  Runtime& runtime;
  FarmLoop::TaskContext& context;
  const Call& call;
  CallSubject& about;  ///< what the call was about, for the action log
  OperationCall& pending;
  std::size_t entries = 0;  ///< of a list in the reply; the caller pays for them
};
/// Part of an operation on the farm thread. Replies that it adds to the task are called before the caller is answered.
using Apply = std::function<Status(OperationContext&)>;

/// Handler of an operation.
struct Handler {
  const WireMessage* request;  ///< empty messages
  const WireMessage* reply;
  std::function<CallSubject(const WireMessage&)> about;  ///< what a request names: a job, worker or token
  bool of_job = false;                                   ///< it names a job, which the caller must be allowed to use
  /// First step, on the caller's thread, which it may block. Returns an empty Apply if nothing is left to do.
  std::function<Result<Apply>(Runtime&, const Call&, WireMessage& request, WireMessage& reply)> begin;
};

/// Properties that differ from most operations.
struct Traits {
  bool http_only = false;  ///< not the RPC's method: the RPC only names the rights
  bool with_film = false;  ///< it runs when the job's film is in memory
  bool waits = false;      ///< answered after its task, and cancelled when its caller is gone (OperationCall)
  /// Limit of its request, also as JSON. 0: small (kSmallRequestBytes over gRPC), and read before admission.
  std::uint64_t most_body_bytes = 0;
  int json_factor = 0;  ///< memory for its JSON in multiples of the reply's bytes; 0: the reply is small
  std::uint64_t (*more_json)(const WireMessage& reply) = nullptr;  ///< memory for its JSON besides
  Status (*fill_json)(WireMessage& reply) = nullptr;               ///< adds fields for JSON
};

/// Limit in bytes of requests without a limit of their own.
inline constexpr std::uint64_t kSmallRequestBytes = 64 << 10;

/// Row of the table of operations.
struct Operation {
  Rpc rpc;  ///< its method for gRPC, and who may call it
  /// HTTP method and path after /api/v1/; empty: not over HTTP. "POST jobs/{id}/pause" has the request's field `id` in
  /// its path. "GET jobs?page_size=1..1000&page_token" allows two fields in its query, and has the range of the number.
  std::string_view http;
  Handler handler;
  Traits traits = {};
};

std::span<const Operation> operations();
/// Operation of a method of gRPC; null if it has none.
const Operation* find_operation(std::string_view method);
/// All methods of gRPC: of the operations, and streams.
std::span<const Rpc> served_rpcs();

// Methods whose rights other calls share.
inline constexpr Rpc kListJobs{kRenderService, "ListJobs", Right::see_farm};
inline constexpr Rpc kListWorkers{kRenderService, "ListWorkers", Right::see_farm};

}  // namespace lightmill

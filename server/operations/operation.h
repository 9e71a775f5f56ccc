// What a caller can ask for in one message, and is answered in another: over gRPC, over HTTP, or both.
#pragma once

#include <google/protobuf/message.h>

#include <functional>
#include <span>
#include <string_view>

#include "server/runtime/records.h"
#include "server/runtime/runtime.h"

namespace lightmill {

class OperationCall;
using WireMessage = google::protobuf::Message;

/// A call whose turn has come, on the farm thread.
struct Asked {
  Runtime& runtime;
  FarmLoop::Turn& turn;
  const Call& call;
  About& about;  ///< what the farm's log says that it was about
  OperationCall& under_way;
};
/// What it adds to the turn's replies is called before the caller is answered.
using Apply = std::function<Status(Asked&)>;

/// How an operation is done.
struct Handler {
  const WireMessage* request;  ///< empty ones
  const WireMessage* reply;
  std::function<About(const WireMessage&)> about;  ///< what a request names
  bool of_job = false;                             ///< that is a job, which the caller has to be allowed to name
  /// The first step, which may take its time: on the caller's thread. Empty if nothing is left to do.
  std::function<Result<Apply>(Runtime&, WireMessage& request, WireMessage& reply)> begin;
};

/// What is not as with most.
struct Traits {
  bool http_only = false;             ///< the RPC only says who may
  bool with_film = false;             ///< the job's film is in memory at its turn
  bool waits = false;                 ///< answered after its turn, and given up when its caller is gone (OperationCall)
  std::uint64_t most_body_bytes = 0;  ///< of its JSON; 0: so few that they are read before the gate is asked
  int json_factor =
      0;  ///< its answer may be large, and takes so many times its bytes while it becomes JSON; 0: it is not
  Status (*fill_json)(WireMessage& reply) = nullptr;  ///< what readers of JSON are told besides
};

/// One line of the table.
struct Operation {
  Rpc rpc;  ///< who may, and whether it is recorded: server/access/rights.cpp
  /// How HTTP asks for it behind /api/v1/; empty: not at all. "POST jobs/{id}/pause" has the request's field `id` in
  /// its path. "GET jobs?page_size=1..1000&page_token" may have two fields in its query, and says what the number may
  /// be.
  std::string_view http;
  Handler handler;
  Traits traits = {};
};

std::span<const Operation> operations();
/// What the method of the RPC does; null if that is no operation.
const Operation* find_operation(Rpc rpc);

}  // namespace lightmill

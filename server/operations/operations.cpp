// Table of operations, of all subjects.
#include <algorithm>

#include "server/operations/handlers.h"

namespace lightmill {

std::span<const Operation> operations() {
  static const std::vector<Operation> table = [] {
    std::vector<Operation> all;
    for (const auto& of_subject :
         {handlers::submission_operations, handlers::job_operations, handlers::worker_operations,
          handlers::history_operations, handlers::access_operations}) {
      std::ranges::move(of_subject(), std::back_inserter(all));
    }
    return all;
  }();
  return table;
}

const Operation* find_operation(std::string_view method) {
  const auto found = std::ranges::find_if(
      operations(), [method](const Operation& each) { return each.rpc.method == method && !each.traits.http_only; });
  return found == operations().end() ? nullptr : &*found;
}

std::span<const Rpc> served_rpcs() {
  static const std::vector<Rpc> rpcs = [] {
    std::vector<Rpc> all(kStreams.begin(), kStreams.end());
    for (const Operation& operation : operations()) {
      if (!operation.traits.http_only) {
        all.push_back(operation.rpc);
      }
    }
    return all;
  }();
  return rpcs;
}

}  // namespace lightmill

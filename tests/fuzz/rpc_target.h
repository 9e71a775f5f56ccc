// A coordinator in this process, to which any bytes can be sent as any request of any service.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/api/api_server.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::fuzz {

class RpcTarget {
 public:
  /// Starts it, with a few jobs, on a free port of the loopback.
  RpcTarget();

  struct Method {
    std::string path;  ///< "/package.Service/Method"
    std::string request, response;
  };
  /// Of all services of the wire.
  const std::vector<Method>& methods() const { return methods_; }
  /// A request of the method that fits the farm, before anything is done to it.
  std::string example(const Method& method) const;

  /// Sends the requests on one stream, hears what comes, and hangs up. Stops the program (LM_CHECK) if the coordinator
  /// answers with a code that says that it is at fault, or not at all though it has nothing to wait for.
  grpc::Status call(const Method& method, const std::vector<std::string>& requests);
  /// Whether `bytes` are a message of this name.
  static bool is_message(const std::string& name, std::string_view bytes);

 private:
  grpc::Status exchange(const Method& method, const std::vector<std::string>& requests,
                        std::chrono::milliseconds patience);

  test::TemporaryFolder folder_;
  std::unique_ptr<Runtime> runtime_;
  std::unique_ptr<ApiServer> server_;
  std::unique_ptr<grpc::GenericStub> stub_;
  std::vector<Method> methods_;
};

}  // namespace lightmill::fuzz

// Coordinator in this process, for any bytes as a request of any method.
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
  /// Methods of all services.
  const std::vector<Method>& methods() const { return methods_; }
  /// Valid request of the method for this farm.
  std::string example(const Method& method) const;

  /// Sends the requests on one stream, reads the answers, and ends the stream. Stops the program (LM_CHECK) if the
  /// coordinator answers with a code for its own errors, or never answers a method that does not wait.
  grpc::Status call(const Method& method, const std::vector<std::string>& requests);
  /// Whether `bytes` are a message of this name.
  static bool is_message(const std::string& name, std::string_view bytes);

 private:
  grpc::Status exchange(const Method& method, const std::vector<std::string>& requests,
                        std::chrono::milliseconds timeout);

  test::TemporaryFolder folder_;
  std::unique_ptr<Runtime> runtime_;
  std::unique_ptr<ApiServer> server_;
  std::unique_ptr<grpc::GenericStub> stub_;
  std::vector<Method> methods_;
};

}  // namespace lightmill::fuzz

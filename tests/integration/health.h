// Health probes: grpc.health.v1, without certificates.
#pragma once

#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/grpcpp.h>

#include <string>

#include "common/base/file.h"
#include "tests/support/process.h"

namespace lightmill::test {

/// "SERVING" or "NOT_SERVING" for that service, the error's code, or "?".
inline std::string health(const std::string& address, const std::string& service = "") {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  grpc::GenericStub stub(grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  // HealthCheckRequest{service}
  std::string bytes;
  if (!service.empty()) {
    bytes = "\x0a";
    for (std::size_t size = service.size();; size >>= 7) {
      bytes.push_back(static_cast<char>((size & 0x7f) | (size > 0x7f ? 0x80 : 0)));
      if (size <= 0x7f) {
        break;
      }
    }
    bytes += service;
  }
  const grpc::Slice slice(bytes);
  const grpc::ByteBuffer request(&slice, 1);
  grpc::CompletionQueue queue;
  const auto call = stub.PrepareUnaryCall(&context, "/grpc.health.v1.Health/Check", request, &queue);
  call->StartCall();
  grpc::ByteBuffer reply;
  grpc::Status status;
  call->Finish(&reply, &status, nullptr);
  void* tag = nullptr;
  bool ok = false;
  queue.Next(&tag, &ok);
  grpc::Slice whole;
  if (!status.ok() || !reply.DumpToSingleSlice(&whole).ok()) {
    return fmt::format("error {}", static_cast<int>(status.error_code()));
  }
  const std::string text(reinterpret_cast<const char*>(whole.begin()), whole.size());
  return text == "\x08\x01" ? "SERVING" : text == "\x08\x02" ? "NOT_SERVING" : "?";
}

/// The address from --health-port-file of a coordinator with --health. Waits for the file.
inline std::string health_address(const std::string& port_file) {
  std::string port;
  (void)eventually([&] {
    port = read_file(port_file).value_or("");
    return !port.empty();
  });
  return "127.0.0.1:" + port.substr(0, port.find('\n'));
}

}  // namespace lightmill::test

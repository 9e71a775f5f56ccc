// A call with one request, which is read when its turn comes.
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpcpp/impl/service_type.h>
#include <grpcpp/server_context.h>
#include <grpcpp/support/server_callback.h>

#include "server/api/grpc_status.h"
#include "server/api/request_reads.h"

namespace lightmill {

/// Base of unary calls and of those with a stream of responses. gRPC's own classes read the request before the handler
/// runs, and so before access control knows the caller. This one begins with the headers.
template <class Request, class Response>
class RequestCall : public grpc::ServerBidiReactor<Request, Response> {
 public:
  void OnReadDone(bool ok) final {
    turn_->end();
    if (ok) {
      request_read();
    } else if (!given_up_) {
      fail(invalid_argument("the request did not come whole, or has more than 20 MiB"));
    }
  }
  void OnCancel() final {
    if (turn_ == nullptr) {
      return;  // refused
    }
    if (!turn_->end()) {
      client_left();
    } else if (!given_up_) {
      fail(make_error(StatusCode::kCancelled, "the client left"));  // no read will end the call
    }
  }

 protected:
  /// Reads the request. Then request_read() or fail() runs, from any thread.
  void read_request(RequestReads& reads, const Holder& holder) {
    turn_ = reads.add(
        holder, [this] { this->StartRead(&request_); }, [this] { give_up(); });
    if (!turn_->begin()) {
      give_up();
    }
  }
  virtual void request_read() = 0;
  /// Ends the call, unless it has ended.
  virtual void fail(const Status& status) = 0;
  virtual void client_left() {}

  Request& request() { return request_; }
  /// No read begins from now on. Call it before Finish, if the request may not be read yet.
  void stop_reading() {
    if (turn_ != nullptr) {
      turn_->end();
    }
  }

 private:
  void give_up() {
    given_up_ = true;
    fail(too_many_requests());
  }

  Request request_;
  std::shared_ptr<ReadTurn> turn_;
  bool given_up_ = false;  ///< set before the turn's end, if at all
};

/// Handler of calls whose reactor is a RequestCall, for MarkMethodStreamed.
template <class Request, class Response>
using RequestCallHandler = grpc::internal::CallbackBidiHandler<Request, Response>;

/// The index of a method in its service.
inline int method_index(const std::string& service, const std::string& method) {
  const auto* const pool = google::protobuf::DescriptorPool::generated_pool();
  return pool->FindServiceByName(service)->FindMethodByName(method)->index();
}

}  // namespace lightmill

// Call of an operation, from its request to its answer.
#pragma once

#include <memory>

#include "server/operations/operation.h"

namespace lightmill {

/// Made by std::make_shared. It lives until it is answered. The caller fills the request before start(), and reads the
/// reply in `done`. Thread-safe after start().
class OperationCall final : public std::enable_shared_from_this<OperationCall> {
 public:
  OperationCall(Runtime& runtime, const Operation& operation);

  const Operation& operation() const { return operation_; }
  WireMessage& request() { return *request_; }
  WireMessage& reply() { return *reply_; }
  /// The subject that the request names, for AccessControl::admit.
  CallSubject about() const { return operation_.handler.about(*request_); }

  /// Called once, from any thread.
  using Done = std::function<void(const Status&)>;
  /// Starts a call that access control has admitted. Changes are recorded, and answered when they are durable.
  void start(Call call, Done done);
  /// The caller is gone.
  void cancel();

  // ---- for operations that wait, on the farm thread ----
  Done answer_later();
  void on_cancel(FarmLoop::Task forget) { forget_ = std::move(forget); }

 private:
  void run(FarmLoop::TaskContext& context);
  void apply(FarmLoop::TaskContext& context);
  Status change_job(OperationContext& operation) const;
  void give_up(FarmLoop::TaskContext& context);
  void finish(const Status& status);

  Runtime& runtime_;
  const Operation& operation_;
  const std::unique_ptr<WireMessage> request_, reply_;
  Call call_;
  Done done_;
  Apply apply_;
  bool cancelled_ = false;  ///< only for the farm thread
  FarmLoop::Task forget_;   ///< only for the farm thread
};

}  // namespace lightmill

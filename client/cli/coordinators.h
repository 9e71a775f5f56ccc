// Connections to the coordinators of a farm. One coordinator is active.
#pragma once

#include <grpcpp/grpcpp.h>

#include <atomic>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "common/base/mutex.h"
#include "common/base/status.h"
#include "common/security/caller.h"
#include "lightmill/v1/access_service.grpc.pb.h"
#include "lightmill/v1/render_service.grpc.pb.h"

namespace lightmill::cli {

/// The services of one coordinator.
struct Stubs {
  explicit Stubs(const std::shared_ptr<grpc::Channel>& channel)
      : render(v1::RenderService::NewStub(channel)), access(v1::AccessService::NewStub(channel)) {}
  template <class Service>
  Service& of() const {
    if constexpr (std::is_same_v<Service, v1::AccessService::Stub>) {
      return *access;
    } else {
      return *render;
    }
  }
  std::unique_ptr<v1::RenderService::Stub> render;
  std::unique_ptr<v1::AccessService::Stub> access;
};

/// Thread-safe.
class Coordinators {
 public:
  /// HOST:PORT of each, with commas. Connects lazily.
  Coordinators(const std::string& addresses, CallerTexts caller);

  /// Adds the caller's token, if it has one, to a call.
  void show_token(grpc::ClientContext& context) const;

  /// Calls the coordinator that answered last. If it does not answer, calls each of the others once. A call that breaks
  /// off after `begun` is set counts as an answer.
  template <class Call>
  Status ask(const Call& call, const bool& begun = kNever) {
    Status status;
    for (std::size_t i = 0; i < addresses_.size(); ++i) {
      const std::size_t index = current_ % addresses_.size();
      const std::shared_ptr<const Stubs> stubs = connected_to(index);
      const grpc::Status answer = call(*stubs);
      status = status_of(answer, index);
      if (status.code() != StatusCode::kUnavailable) {
        return status;
      }
      forget_if_silent(index, stubs, answer);
      std::size_t expected = index;  // another thread may have switched already
      current_.compare_exchange_strong(expected, (index + 1) % addresses_.size());
      if (begun) {
        break;
      }
    }
    return status;
  }

 private:
  std::shared_ptr<const Stubs> connected_to(std::size_t index);
  /// After silence, the next call gets a new connection. A channel works only within calls. So a handshake that it began
  /// would stand still between them, and the coordinator would close it.
  void forget_if_silent(std::size_t index, const std::shared_ptr<const Stubs>& stubs, const grpc::Status& answer);
  /// The status of an answer of coordinator `index`, or of its silence.
  Status status_of(const grpc::Status& answer, std::size_t index) const;

  static constexpr bool kNever = false;
  const std::string all_;
  const CallerTexts caller_;
  std::vector<std::string> addresses_;
  std::atomic<std::size_t> current_ = 0;
  Mutex mutex_;
  std::vector<std::shared_ptr<const Stubs>> stubs_ LM_GUARDED_BY(mutex_);  ///< null: not connected
};

}  // namespace lightmill::cli

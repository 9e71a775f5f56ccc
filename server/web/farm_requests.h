// Round trip of an HTTP request to the farm thread and back.
#pragma once

#include <functional>
#include <map>
#include <memory>

#include "server/runtime/farm_loop.h"
#include "server/web/http_text.h"
#include "server/web/job_feed.h"

namespace lightmill {

/// Called once, on the web thread.
using Reply = std::function<void(ApiReply)>;

/// Passes an answer from any thread to its waiting reply, if that still exists.
class PendingReply {
 public:
  using Waiting = std::map<std::uint64_t, Reply>;
  PendingReply(OnWebThread on_web_thread, const std::shared_ptr<Waiting>& waiting, std::uint64_t id)
      : on_web_thread_(std::move(on_web_thread)), waiting_(waiting), id_(id) {}
  void operator()(ApiReply answer) const {
    compute([answer = std::move(answer)] { return answer; });
  }
  /// Computes the answer on the web thread.
  void compute(std::function<ApiReply()> answer) const;

 private:
  OnWebThread on_web_thread_;
  std::weak_ptr<Waiting> waiting_;  ///< used on the web thread
  std::uint64_t id_;
};

/// Used on the web thread.
class FarmRequests {
 public:
  FarmRequests(FarmLoop& loop, OnWebThread on_web_thread) : loop_(loop), on_web_thread_(std::move(on_web_thread)) {}

  /// Registers `reply`. The caller calls the result in its place.
  PendingReply expect(Reply reply);

  /// Runs `task` on the farm thread. The task calls the reply at once, or after the commit.
  using Task = std::function<void(FarmLoop::TaskContext&, const PendingReply&)>;
  void post(Reply reply, Task task);

 private:
  FarmLoop& loop_;
  const OnWebThread on_web_thread_;
  const std::shared_ptr<PendingReply::Waiting> waiting_ = std::make_shared<PendingReply::Waiting>();
  std::uint64_t next_id_ = 1;
};

}  // namespace lightmill

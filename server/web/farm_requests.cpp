#include "server/web/farm_requests.h"

#include "server/runtime/farm_loop.h"

namespace lightmill {

void PendingReply::compute(std::function<ApiReply()> answer) const {
  on_web_thread_([waiting = waiting_, id = id_, answer = std::move(answer)] {
    const auto replies = waiting.lock();
    if (replies == nullptr || !replies->contains(id)) {
      return;
    }
    const Reply reply = std::move(replies->at(id));
    replies->erase(id);
    reply(answer());
  });
}

PendingReply FarmRequests::expect(Reply reply) {
  waiting_->emplace(next_id_, std::move(reply));
  return {on_web_thread_, waiting_, next_id_++};
}

void FarmRequests::post(Reply reply, Task task) {
  const PendingReply back = expect(std::move(reply));
  if (!loop_.post([task = std::move(task), back](FarmLoop::TaskContext& context) { task(context, back); })) {
    back(error_reply(busy()));
  }
}

}  // namespace lightmill

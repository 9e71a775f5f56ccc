#include "server/web/farm_reply.h"

#include "server/runtime/records.h"

namespace lightmill {

void FarmReply::compute(std::function<ApiReply()> answer) const {
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

FarmReply FarmDesk::expect(Reply reply) {
  waiting_->emplace(next_id_, std::move(reply));
  return {on_web_thread_, waiting_, next_id_++};
}

void FarmDesk::ask(Reply reply, FarmTask task) {
  const FarmReply back = expect(std::move(reply));
  if (!loop_.post([task = std::move(task), back](FarmLoop::Turn& turn) { task(turn, back); })) {
    back(error_reply(busy()));
  }
}

}  // namespace lightmill

#include "server/web/farm_reply.h"

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

void FarmDesk::ask(Reply reply, FarmTask task, std::optional<JobId> with_film_of) {
  if (!with_film_of) {
    return run(expect(std::move(reply)), std::move(task));
  }
  run(expect(std::move(reply)),
      [job = *with_film_of, task = std::move(task)](FarmLoop::Turn& turn, const FarmReply& back) {
        turn.with_film(job, [task, back](FarmLoop::Turn& later, const Status& here) {
          here.ok() ? task(later, back) : back(error_reply(here));
        });
      });
}

void FarmDesk::run(const FarmReply& back, FarmTask task) const {
  if (!loop_.post([task = std::move(task), back](FarmLoop::Turn& turn) { task(turn, back); })) {
    back(error_reply(resource_exhausted("the farm has too much to do at once: try again")));
  }
}

}  // namespace lightmill

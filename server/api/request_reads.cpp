#include "server/api/request_reads.h"

namespace lightmill {

bool ReadTurn::begin() {
  {
    const MutexLock lock(mutex_);
    ended_ = false;
    read_called_ = false;
  }
  bool waits = false;
  RequestReads::Changes changes;
  {
    const MutexLock lock(reads_.mutex_);
    if (reads_.is_full_for(holder_)) {
      changes = reads_.start_next();  // others may have stalled by now
    }
    if (!reads_.is_full_for(holder_)) {
      id_ = reads_.next_id_++;
      state_ = State::waiting;
      reads_.waiting_[holder_].emplace(id_, shared_from_this());
      ++reads_.waiting_count_;
      changes.add(reads_.start_next());
      waits = true;
    }
  }
  RequestReads::run(changes);
  return waits;
}

bool ReadTurn::end() {
  bool called = false;
  {
    const MutexLock lock(mutex_);  // waits for start() and evict()
    ended_ = true;
    called = read_called_;
  }
  RequestReads::Changes changes;
  {
    const MutexLock lock(reads_.mutex_);
    switch (std::exchange(state_, State::idle)) {
      case State::idle:
        break;
      case State::waiting: {
        const auto queue = reads_.waiting_.find(holder_);
        queue->second.erase(id_);
        --reads_.waiting_count_;
        if (queue->second.empty()) {
          reads_.waiting_.erase(queue);
        }
        break;
      }
      case State::reading:
        reads_.pool_.release(id_);
        reads_.reading_.erase(id_);
        changes = reads_.start_next();
        break;
    }
  }
  RequestReads::run(changes);
  return !called;
}

void ReadTurn::start() {
  const MutexLock lock(mutex_);
  if (!ended_) {
    read_called_ = true;
    read_();
  }
}

void ReadTurn::evict() {
  const MutexLock lock(mutex_);
  if (!ended_) {
    ended_ = true;  // another turn has its place, so start() must not read any more
    give_up_();
  }
}

bool RequestReads::is_full_for(const Holder& holder) const {
  const auto queue = waiting_.find(holder);
  return waiting_count_ >= most_waiting_ ||
         (queue != waiting_.end() && queue->second.size() >= (most_waiting_ + 1) / 2);
}

void RequestReads::Changes::add(Changes more) {
  started.insert(started.end(), more.started.begin(), more.started.end());
  evicted.insert(evicted.end(), more.evicted.begin(), more.evicted.end());
}

/// Ends at the first holder whose turn would be one too many for all.
RequestReads::Changes RequestReads::start_next() {
  Changes changes;
  const Time now = clock_.now();
  SlotPool::Answer answer = SlotPool::Answer::acquired;
  for (auto at = waiting_.begin(); at != waiting_.end() && answer != SlotPool::Answer::full;) {
    auto& [holder, queue] = *at;
    while (!queue.empty()) {
      const auto [id, turn] = *queue.begin();
      const SlotPool::Arrival arrival = pool_.acquire(id, holder, now);
      answer = arrival.answer;
      if (answer != SlotPool::Answer::acquired) {
        break;
      }
      if (arrival.evicted) {
        auto evicted = reading_.extract(*arrival.evicted);
        evicted.mapped()->state_ = ReadTurn::State::idle;
        changes.evicted.push_back(std::move(evicted.mapped()));
      }
      pool_.set_stalled(id, now);
      turn->state_ = ReadTurn::State::reading;
      reading_.emplace(id, turn);
      changes.started.push_back(turn);
      queue.erase(queue.begin());
      --waiting_count_;
    }
    at = queue.empty() ? waiting_.erase(at) : std::next(at);
  }
  return changes;
}

void RequestReads::run(const Changes& changes) {
  for (const std::shared_ptr<ReadTurn>& turn : changes.evicted) {
    turn->evict();
  }
  for (const std::shared_ptr<ReadTurn>& turn : changes.started) {
    turn->start();
  }
}

}  // namespace lightmill

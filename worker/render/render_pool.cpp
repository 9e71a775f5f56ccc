#include "worker/render/render_pool.h"

#include <algorithm>

namespace lightmill {
namespace {

/// The workspaces of one thread, for the methods that it used last.
class Workspaces {
 public:
  Workspace& of(const std::shared_ptr<const Method>& method) {
    for (Entry& entry : entries_) {
      if (entry.method == method) {
        return *entry.workspace;
      }
    }
    if (entries_.size() == kMost) {
      entries_.pop_back();
    }
    entries_.push_front({method, method->make_workspace()});
    return *entries_.front().workspace;
  }

 private:
  static constexpr std::size_t kMost = 2;
  struct Entry {
    std::shared_ptr<const Method> method;
    std::unique_ptr<Workspace> workspace;
  };
  std::deque<Entry> entries_;
};

}  // namespace

RenderPool::RenderPool(std::uint32_t threads, Done done, Tamper tamper)
    : done_(std::move(done)), tamper_(std::move(tamper)) {
  for (std::uint32_t i = 0; i < threads; ++i) {
    threads_.emplace_back([this] { run(); });
  }
}

RenderPool::~RenderPool() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    changed_.notify_all();
  }
  for (std::thread& thread : threads_) {
    thread.join();
  }
}

void RenderPool::add(RenderTask task) {
  const MutexLock lock(mutex_);
  const bool first_sample = task.range.first() == 0;
  const auto others = std::ranges::find_if(tasks_, [](const RenderTask& each) { return each.range.first() > 0; });
  tasks_.insert(first_sample ? others : tasks_.end(), std::move(task));
  changed_.notify_one();
}

void RenderPool::run() {
  Workspaces workspaces;
  for (;;) {
    RenderTask task;
    {
      const MutexLock lock(mutex_);
      while (tasks_.empty() && !stopping_) {
        changed_.wait(mutex_);
      }
      if (stopping_) {
        return;
      }
      task = std::move(tasks_.front());
      tasks_.pop_front();
    }
    const auto start = std::chrono::steady_clock::now();
    RenderedTile tile;
    tile.ticket = task.ticket;
    tile.node = task.method->render(task.rect, task.range, workspaces.of(task.method));
    if (tamper_) {
      tamper_(tile.node);
    }
    tile.hash = hash_of(tile.node);
    tile.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    done_(std::move(tile));
  }
}

}  // namespace lightmill

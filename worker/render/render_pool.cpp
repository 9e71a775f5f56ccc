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
    for (auto& [ticket, stop] : stops_) {
      stop.request_stop();
    }
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
  stops_.try_emplace(task.ticket);
  tasks_.insert(first_sample ? others : tasks_.end(), std::move(task));
  changed_.notify_one();
}

void RenderPool::stop(std::uint64_t ticket) {
  const MutexLock lock(mutex_);
  if (const auto found = stops_.find(ticket); found != stops_.end()) {
    found->second.request_stop();
  }
}

void RenderPool::run() {
  Workspaces workspaces;
  for (;;) {
    RenderTask task;
    std::stop_token stop;
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
      stop = stops_.at(task.ticket).get_token();
    }
    const auto start = std::chrono::steady_clock::now();
    RenderedTile tile;
    tile.ticket = task.ticket;
    Workspace& workspace = workspaces.of(task.method);
    workspace.stop = std::move(stop);
    tile.node = task.method->render(task.rect, task.range, workspace);
    if (tamper_ && !tile.node.values.empty()) {
      tamper_(tile.node);
    }
    tile.hash = hash_of(tile.node);
    tile.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    {
      const MutexLock lock(mutex_);
      stops_.erase(task.ticket);
    }
    done_(std::move(tile));
  }
}

}  // namespace lightmill

#include "worker/render/render_pool.h"

#include <pthread.h>

#include <algorithm>

#include "common/base/check.h"
#include "worker/render/scene_limits.h"

namespace lightmill {
namespace {

/// Workspaces of one thread for its last methods. They keep neither methods nor scenes alive.
class Workspaces {
 public:
  Workspace& of(const std::shared_ptr<const Method>& method) {
    for (Entry& entry : entries_) {
      if (entry.method.lock() == method) {
        return *entry.workspace;
      }
    }
    if (entries_.size() == kMax) {
      entries_.pop_back();
    }
    entries_.push_front({method, method->make_workspace()});
    return *entries_.front().workspace;
  }
  void clear() { entries_.clear(); }

 private:
  static constexpr std::size_t kMax = 2;
  struct Entry {
    std::weak_ptr<const Method> method;
    std::unique_ptr<Workspace> workspace;
  };
  std::deque<Entry> entries_;
};

}  // namespace

CpuClock::CpuClock() {
  LM_CHECK(pthread_getcpuclockid(pthread_self(), &clock_) == 0);
  begun_ = now();
}

double CpuClock::now() const {
  timespec time = {};
  LM_CHECK(clock_gettime(clock_, &time) == 0);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

RenderPool::RenderPool(std::uint32_t threads, Done done, Tamper tamper)
    : done_(std::move(done)), tamper_(std::move(tamper)) {
  try {
    for (std::uint32_t i = 0; i < threads; ++i) {
      threads_.emplace_back([this] { run(); });
    }
  } catch (...) {
    end();
    throw;
  }
}

RenderPool::~RenderPool() {
  end();
}

void RenderPool::end() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    for (auto& [ticket, state] : states_) {
      state.stop.request_stop();
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
  states_.try_emplace(task.ticket);
  tasks_.insert(first_sample ? others : tasks_.end(), std::move(task));
  changed_.notify_one();
}

void RenderPool::stop(std::uint64_t ticket) {
  const MutexLock lock(mutex_);
  if (const auto found = states_.find(ticket); found != states_.end()) {
    found->second.stop.request_stop();
  }
}

std::vector<std::pair<std::uint64_t, double>> RenderPool::at_work() const {
  const MutexLock lock(mutex_);
  std::vector<std::pair<std::uint64_t, double>> all;
  for (const auto& [ticket, state] : states_) {
    if (state.cpu) {
      all.emplace_back(ticket, state.cpu->seconds());
    }
  }
  return all;
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
      State& state = states_.at(task.ticket);
      state.cpu.emplace();
      stop = state.stop.get_token();
    }
    const auto start = std::chrono::steady_clock::now();
    RenderedTile tile;
    tile.ticket = task.ticket;
    Result<Node> node = within_limits("samples were rendered", [&]() -> Result<Node> {
      Workspace& workspace = workspaces.of(task.method);
      workspace.stop = stop;
      return task.method->render(task.rect, task.range, workspace);
    });
    if (node.ok()) {
      tile.node = *std::move(node);
    } else {
      workspaces.clear();  // the state of the last workspace is unknown
      tile.lacks = message_of(node.status());
    }
    if (tamper_ && !tile.node.values.empty()) {
      tamper_(tile.node);
    }
    tile.hash = hash_of(tile.node);
    tile.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    {
      const MutexLock lock(mutex_);
      states_.erase(task.ticket);
    }
    done_(std::move(tile));
  }
}

}  // namespace lightmill

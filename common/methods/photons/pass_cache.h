// Cache of the passes of a method: one per sample index, shared by threads.
#pragma once

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <stop_token>

#include "common/base/mutex.h"
#include "common/methods/spec/method_spec.h"

namespace lightmill::photons {

/// The first thread that needs a pass traces it. Other threads wait, or trace the next one. The cache holds the last
/// used passes, kHeldPassBytes in all. Passes in use stay alive. Thread-safe.
template <class Pass>
class PassCache {
 public:
  /// The pass of a sample index. While it waits, the thread may trace other passes of [sample, end). `trace(sample)`
  /// returns a pass, or null if `stop` was requested. Then the result is null.
  template <class Trace>
  std::shared_ptr<const Pass> get(std::uint64_t sample, std::uint64_t end, const std::stop_token& stop,
                                  const Trace& trace) LM_EXCLUDES(mutex_) {
    while (!stop.stop_requested()) {
      std::optional<std::uint64_t> own;
      {
        const MutexLock lock(mutex_);
        ++calls_;
        if (const auto found = held_.find(sample); found != held_.end() && found->second.pass != nullptr) {
          found->second.used = calls_;
          return found->second.pass;
        }
        own = claim(sample, end);
        if (!own) {
          changed_.wait(mutex_);
          continue;
        }
      }
      std::shared_ptr<const Pass> traced;
      try {
        traced = trace(*own);
      } catch (...) {
        finish(*own, nullptr);
        throw;
      }
      finish(*own, traced);
      if (*own == sample) {
        return traced;
      }
    }
    return nullptr;
  }

 private:
  static constexpr std::uint64_t kLookAhead = 16;  ///< passes that threads may trace ahead

  struct Held {
    std::shared_ptr<const Pass> pass;  ///< null while a thread traces it
    std::uint64_t used = 0;            ///< number of the last call that used it
  };

  /// The pass that the caller must trace, if any: `sample` or a later one.
  std::optional<std::uint64_t> claim(std::uint64_t sample, std::uint64_t end) LM_REQUIRES(mutex_) {
    const std::uint64_t ahead =
        heaviest_ == 0 ? kLookAhead : std::clamp<std::uint64_t>(kHeldPassBytes / heaviest_, 1, kLookAhead);
    for (std::uint64_t next = sample; next < std::min(end, sample + ahead); ++next) {
      if (held_.try_emplace(next).second) {
        return next;
      }
    }
    return std::nullopt;
  }

  void finish(std::uint64_t sample, std::shared_ptr<const Pass> pass) LM_EXCLUDES(mutex_) {
    const MutexLock lock(mutex_);
    if (pass == nullptr) {
      held_.erase(sample);
    } else {
      bytes_ += pass->bytes();
      heaviest_ = std::max<std::uint64_t>(heaviest_, pass->bytes());
      held_[sample] = {std::move(pass), calls_};
      drop_oldest(sample);
    }
    changed_.notify_all();
  }

  /// Drops passes until the others fit, but not `kept`.
  void drop_oldest(std::uint64_t kept) LM_REQUIRES(mutex_) {
    while (bytes_ > kHeldPassBytes) {
      auto oldest = held_.end();
      for (auto it = held_.begin(); it != held_.end(); ++it) {
        if (it->second.pass != nullptr && it->first != kept &&
            (oldest == held_.end() || it->second.used < oldest->second.used)) {
          oldest = it;
        }
      }
      if (oldest == held_.end()) {
        break;
      }
      bytes_ -= oldest->second.pass->bytes();
      held_.erase(oldest);
    }
  }

  Mutex mutex_;
  CondVar changed_;
  std::map<std::uint64_t, Held> held_ LM_GUARDED_BY(mutex_);
  std::uint64_t bytes_ LM_GUARDED_BY(mutex_) = 0;
  /// Bytes of the largest pass. Threads trace only as many passes ahead as the cache holds.
  std::uint64_t heaviest_ LM_GUARDED_BY(mutex_) = 0;
  std::uint64_t calls_ LM_GUARDED_BY(mutex_) = 0;
};

}  // namespace lightmill::photons

// A std::mutex with annotations, which clang's thread-safety analysis checks.
#pragma once

#include <condition_variable>
#include <mutex>

#if defined(__clang__)
#define LM_THREAD_ANNOTATION(x) __attribute__((x))
#else
#define LM_THREAD_ANNOTATION(x)
#endif
#define LM_GUARDED_BY(mutex) LM_THREAD_ANNOTATION(guarded_by(mutex))
#define LM_REQUIRES(...) LM_THREAD_ANNOTATION(requires_capability(__VA_ARGS__))
#define LM_EXCLUDES(...) LM_THREAD_ANNOTATION(locks_excluded(__VA_ARGS__))

namespace lightmill {

class LM_THREAD_ANNOTATION(capability("mutex")) Mutex {
 public:
  void lock() LM_THREAD_ANNOTATION(acquire_capability()) { mutex_.lock(); }
  void unlock() LM_THREAD_ANNOTATION(release_capability()) { mutex_.unlock(); }

 private:
  std::mutex mutex_;
};

/// Holds a Mutex for a scope.
class LM_THREAD_ANNOTATION(scoped_lockable) MutexLock {
 public:
  explicit MutexLock(Mutex& mutex) LM_THREAD_ANNOTATION(acquire_capability(mutex)) : mutex_(mutex) { mutex_.lock(); }
  ~MutexLock() LM_THREAD_ANNOTATION(release_capability()) { mutex_.unlock(); }
  MutexLock(const MutexLock&) = delete;
  MutexLock& operator=(const MutexLock&) = delete;

 private:
  Mutex& mutex_;
};

/// A condition variable for Mutex. Write the loop over the condition by hand: the analysis does not look into
/// predicates.
class CondVar {
 public:
  void wait(Mutex& mutex) LM_REQUIRES(mutex) { condition_.wait(mutex); }
  template <class TimePoint>
  std::cv_status wait_until(Mutex& mutex, const TimePoint& until) LM_REQUIRES(mutex) {
    return condition_.wait_until(mutex, until);
  }
  void notify_one() { condition_.notify_one(); }
  void notify_all() { condition_.notify_all(); }

 private:
  std::condition_variable_any condition_;
};

}  // namespace lightmill

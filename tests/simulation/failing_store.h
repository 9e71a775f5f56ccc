// Store that fails once, at a drawn call: like a full or failing disk, or together with its process.
#pragma once

#include <unistd.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <new>
#include <thread>

#include "server/store/store.h"
#include "tests/simulation/random.h"

namespace lightmill::simulation {

enum class StoreFault {
  none,
  full,     ///< the disk is full, for two tries
  away,     ///< too many files are open, for two tries
  damaged,  ///< the store is unusable
  memory,   ///< allocation fails, before or after the work of the call
  killed,   ///< the process is killed, before or after the work of the call
  lies,     ///< planted bug: a commit is reported but not stored
};

class FailingStore final : public Store {
 public:
  /// Fails at call number `at_call`, from 1 on. Some commits are slow.
  FailingStore(std::unique_ptr<Store> store, StoreFault fault, std::uint64_t at_call, std::uint64_t seed)
      : store_(std::move(store)), fault_(fault), at_call_(at_call), random_(seed), after_(random_.chance(0.5)) {}

  Result<StoredState> load() override { return store_->load(); }
  Status check_structure() override { return store_->check_structure(); }
  bool tidy() override { return store_->tidy(); }
  Result<FilmPiece> read_film(JobId job, const FilmPosition& after) override {
    return call<Result<FilmPiece>>([&] { return store_->read_film(job, after); });
  }
  Status commit(std::span<const StoreOp> ops) override {
    if (random_.chance(0.2)) {
      std::this_thread::sleep_for(random_.seconds_between(0, 0.01));
    }
    return call<Status>([&] {
      const bool lies = fault_ == StoreFault::lies && calls_ >= at_call_ && !std::exchange(lied_, true);
      return lies ? ok_status() : store_->commit(ops);
    });
  }

 private:
  template <class T, class Work>
  T call(const Work& work) {
    const bool now = ++calls_ == at_call_;
    if (now && !after_) {
      end();
    }
    const bool fails = calls_ == at_call_ || calls_ == at_call_ + 1;
    if (fails && fault_ == StoreFault::full) {
      return resource_exhausted("the disk is full");
    }
    if (fails && fault_ == StoreFault::away) {
      return unavailable("too many open files");
    }
    if (now && fault_ == StoreFault::damaged) {
      return data_loss("the database is damaged");
    }
    T result = work();
    if (now && after_) {
      end();
    }
    return result;
  }
  void end() const {
    if (fault_ == StoreFault::memory) {
      throw std::bad_alloc();
    }
    if (fault_ == StoreFault::killed) {
      ::kill(::getpid(), SIGKILL);
    }
  }

  const std::unique_ptr<Store> store_;
  const StoreFault fault_;
  const std::uint64_t at_call_;
  Random random_;
  const bool after_;
  bool lied_ = false;
  std::uint64_t calls_ = 0;
};

}  // namespace lightmill::simulation

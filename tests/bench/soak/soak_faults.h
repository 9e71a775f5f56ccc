// What goes wrong in a soak: one fault at a time, drawn at random, done to a farm's processes, lines and disk.
#pragma once

#include <fmt/format.h>

#include <functional>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/support/farm.h"
#include "tests/support/fault_proxy.h"
#include "tests/support/small_disk.h"

namespace lightmill::soak {

inline constexpr int kWorkers = 3;
inline constexpr int kDiskMib = 512;  ///< of the disk that is filled; in memory

/// A farm of three workers of one thread; each of them, and who gives jobs, calls the coordinator over a line that can
/// be disturbed. Ends what it has begun.
class TroubledFarm {
 public:
  /// `disk`: where the farm's state lies, if it can be filled.
  TroubledFarm(const test::SmallDisk* disk, std::uint64_t seed);

  test::Farm& farm() { return farm_; }
  std::string address() const { return lines_.back()->address(); }
  static std::string worker_name(int i) { return fmt::format("w{}", i + 1); }

  /// Does something and says what. The first two workers may be killed, the third one lives on; the coordinator may if
  /// `may_kill_coordinator`.
  std::string begin_fault(bool may_kill_coordinator);
  /// Undoes it.
  void end_fault();
  bool in_fault() const { return end_ != nullptr; }
  /// Between faults: those of coordinator and workers that have ended without having been told to, or have not ended
  /// well, in words.
  std::vector<std::string> ended_by_themselves();

 private:
  struct Fault {
    const char* name;
    std::function<void()> (TroubledFarm::*begin)();  ///< what it returns ends the fault
  };
  std::function<void()> kill_worker();
  std::function<void()> end_worker();
  std::function<void()> stop_worker();
  std::function<void()> kill_coordinator();
  std::function<void()> stop_coordinator();
  std::function<void()> cut_line();
  std::function<void()> break_line();
  std::function<void()> stall_line();
  std::function<void()> slow_line();
  std::function<void()> fill_disk();
  std::function<void()> fill_disk_nearly();

  test::FaultProxy& any_line() { return *lines_[random_() % lines_.size()]; }

  const test::SmallDisk* const disk_;
  std::mt19937_64 random_;
  test::Farm farm_;
  std::vector<std::unique_ptr<test::FaultProxy>> lines_;  ///< of the workers, and the clients' one
  std::function<void()> end_;
  std::vector<std::string> badly_ended_;  ///< workers that were told to end
};

}  // namespace lightmill::soak

// Faults of a soak: one at a time, drawn at random, on a farm's processes, connections and disk.
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

/// A farm of three workers with one thread each. Workers and clients reach the coordinator through proxies that can
/// fail. Ends the fault in progress at its own end.
class TroubledFarm {
 public:
  /// `disk`: where the farm's state is, if it can be filled.
  TroubledFarm(const test::SmallDisk* disk, std::uint64_t seed);

  test::Farm& farm() { return farm_; }
  std::string address() const { return proxies_.back()->address(); }
  static std::string worker_name(int i) { return fmt::format("w{}", i + 1); }

  /// Begins a fault and describes it. The first two workers may be killed, and the third one is not. The coordinator
  /// may be killed if `may_kill_coordinator`.
  std::string begin_fault(bool may_kill_coordinator);
  /// Ends the fault.
  void end_fault();
  bool in_fault() const { return end_ != nullptr; }
  /// Between faults: descriptions of the coordinators and workers that ended without an order, or with an error.
  std::vector<std::string> ended_by_themselves();

 private:
  struct Fault {
    const char* name;
    std::function<void()> (TroubledFarm::*begin)();  ///< the returned function ends the fault
  };
  std::function<void()> kill_worker();
  std::function<void()> end_worker();
  std::function<void()> stop_worker();
  std::function<void()> kill_coordinator();
  std::function<void()> stop_coordinator();
  std::function<void()> cut_connections();
  std::function<void()> refuse_connections();
  std::function<void()> stall_connections();
  std::function<void()> slow_connections();
  std::function<void()> fill_disk();
  std::function<void()> fill_disk_nearly();

  test::FaultProxy& any_proxy() { return *proxies_[random_() % proxies_.size()]; }

  const test::SmallDisk* const disk_;
  std::mt19937_64 random_;
  test::Farm farm_;
  std::vector<std::unique_ptr<test::FaultProxy>> proxies_;  ///< of the workers and of the clients
  std::function<void()> end_;
  std::vector<std::string> badly_ended_;  ///< workers that ended with an error after an order
};

}  // namespace lightmill::soak

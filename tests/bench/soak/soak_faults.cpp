#include "tests/bench/soak/soak_faults.h"

#include <signal.h>

namespace lightmill::soak {
namespace {

using std::chrono::milliseconds;
using test::Way;

constexpr auto kToFinish = std::chrono::seconds(60);  // for a worker to finish its units

void nothing_to_undo() {}

}  // namespace

// Silent workers lose their work after 4 s. So some faults of 1 to 8 s pass, and some cost leases.
TroubledFarm::TroubledFarm(const test::SmallDisk* disk, std::uint64_t seed)
    : disk_(disk),
      random_(seed),
      farm_({"--lease-seconds", "4", "--heartbeat-seconds", "1", "--reserve-gib", "0.0625"}) {
  for (int i = 0; i < kWorkers; ++i) {
    proxies_.push_back(std::make_unique<test::FaultProxy>(farm_.address()));
    farm_.add_worker(1, worker_name(i), {proxies_.back()->address(), {}, {}});
  }
  proxies_.push_back(std::make_unique<test::FaultProxy>(farm_.address()));
}

std::string TroubledFarm::begin_fault(bool may_kill_coordinator) {
  static const std::vector<Fault> all{{"worker killed (SIGKILL)", &TroubledFarm::kill_worker},
                                      {"worker ended (SIGTERM)", &TroubledFarm::end_worker},
                                      {"worker stopped for a while (SIGSTOP)", &TroubledFarm::stop_worker},
                                      {"coordinator stopped for a while (SIGSTOP)", &TroubledFarm::stop_coordinator},
                                      {"connections cut", &TroubledFarm::cut_connections},
                                      {"connections cut and refused for a while", &TroubledFarm::refuse_connections},
                                      {"connections stalled, one way or both", &TroubledFarm::stall_connections},
                                      {"connections slowed by up to 0.5 s", &TroubledFarm::slow_connections},
                                      {"disk nearly full for a while", &TroubledFarm::fill_disk_nearly},
                                      {"disk full for a while", &TroubledFarm::fill_disk},
                                      {"coordinator killed (SIGKILL)", &TroubledFarm::kill_coordinator}};
  const std::size_t kill_coordinator = all.size() - 1, disk_full = all.size() - 2, disk_nearly_full = all.size() - 3;
  for (;;) {
    const std::size_t i = random_() % all.size();
    if ((i == kill_coordinator && !may_kill_coordinator) ||
        ((i == disk_full || i == disk_nearly_full) && disk_ == nullptr)) {
      continue;
    }
    end_ = (this->*all[i].begin)();
    return all[i].name;
  }
}

void TroubledFarm::end_fault() {
  if (end_) {
    end_();
    end_ = nullptr;
  }
}

std::vector<std::string> TroubledFarm::ended_by_themselves() {
  std::vector<std::string> ended = std::exchange(badly_ended_, {});
  if (const std::optional<int> code = farm_.server().wait(milliseconds(0))) {
    ended.push_back(fmt::format("the coordinator has ended with code {}:\n{}", *code, farm_.server_log()));
  }
  for (int i = 0; i < kWorkers; ++i) {
    if (const std::optional<int> code = farm_.worker(worker_name(i)).wait(milliseconds(0))) {
      ended.push_back(fmt::format("worker {} has ended with code {}", worker_name(i), *code));
    }
  }
  return ended;
}

std::function<void()> TroubledFarm::kill_worker() {
  farm_.replace_worker(worker_name(static_cast<int>(random_() % 2)));
  return nothing_to_undo;
}

std::function<void()> TroubledFarm::end_worker() {
  const std::string name = worker_name(static_cast<int>(random_() % 2));
  farm_.worker(name).send(SIGTERM);
  return [this, name] {
    const std::optional<int> code = farm_.worker(name).wait(kToFinish);
    if (code != 0) {
      badly_ended_.push_back(fmt::format("worker {}, asked to drain, {}", name,
                                         code ? fmt::format("ended with code {}", *code) : "did not"));
    }
    if (!code) {
      farm_.replace_worker(name);
    } else {
      farm_.start_worker_again(name);
    }
  };
}

std::function<void()> TroubledFarm::stop_worker() {
  const std::string name = worker_name(static_cast<int>(random_() % kWorkers));
  farm_.worker(name).send(SIGSTOP);
  return [this, name] { farm_.worker(name).send(SIGCONT); };
}

std::function<void()> TroubledFarm::kill_coordinator() {
  test::kill_at_once(farm_.server());
  return [this] { farm_.start_server(); };
}

std::function<void()> TroubledFarm::stop_coordinator() {
  farm_.server().send(SIGSTOP);
  return [this] { farm_.server().send(SIGCONT); };
}

std::function<void()> TroubledFarm::cut_connections() {
  any_proxy().cut();
  return nothing_to_undo;
}

std::function<void()> TroubledFarm::refuse_connections() {
  test::FaultProxy& proxy = any_proxy();
  proxy.refuse(true);
  proxy.cut();
  return [&proxy] { proxy.refuse(false); };
}

std::function<void()> TroubledFarm::stall_connections() {
  test::FaultProxy& proxy = any_proxy();
  const std::uint64_t ways = 1 + random_() % 3;
  const auto stall = [&proxy, ways](bool on) {
    proxy.stall(Way::there, on && (ways & 1) != 0);
    proxy.stall(Way::back, on && (ways & 2) != 0);
  };
  stall(true);
  return [stall] { stall(false); };
}

std::function<void()> TroubledFarm::slow_connections() {
  test::FaultProxy& proxy = any_proxy();
  const auto slow = [&proxy](milliseconds most) {
    proxy.delay(Way::there, milliseconds(0), most);
    proxy.delay(Way::back, milliseconds(0), most);
  };
  slow(milliseconds(500));
  return [slow] { slow(milliseconds(0)); };
}

std::function<void()> TroubledFarm::fill_disk() {
  disk_->fill(kDiskMib);
  return [this] { disk_->make_room(); };
}

/// Leaves less free space than --reserve-gib.
std::function<void()> TroubledFarm::fill_disk_nearly() {
  const std::uint64_t left = std::filesystem::space(farm_.folder()).available >> 20;
  disk_->fill(left > 32 ? static_cast<int>(left - 32) : 0);
  return [this] { disk_->make_room(); };
}

}  // namespace lightmill::soak

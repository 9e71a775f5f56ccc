#include "tests/support/networks.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <thread>

#include "common/base/check.h"
#include "common/base/status.h"
#include "tests/support/process.h"

namespace lightmill::test {
namespace {

constexpr const char* kIp = "/sbin/ip";
constexpr const char* kNft = "/sbin/nft";

CommandResult ip(const std::string& words) {
  return run_command({"/bin/sh", "-c", std::string("exec ") + kIp + " " + words});
}

void expect_ip(const std::string& words) {
  const CommandResult result = ip(words);
  EXPECT_EQ(result.exit_code, 0) << "ip " << words << ": " << result.err;
}

/// Gives this thread a network, and an empty folder for the names of networks. Both end with the last process in them.
bool enter_own_network() {
  return ::unshare(CLONE_NEWNET | CLONE_NEWNS) == 0 &&
         ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) == 0 &&
         (::mkdir("/run/netns", 0755) == 0 || errno == EEXIST) &&
         ::mount("none", "/run/netns", "tmpfs", 0, nullptr) == 0;
}

/// nft rules that drop `percent` of the packets of a direction (input, output). They replace the earlier rules.
std::string loss_rules(const std::string& direction, int percent) {
  std::string rules = fmt::format(
      "add table inet lightmill\n"
      "add chain inet lightmill {0} {{ type filter hook {0} priority 0; }}\n"
      "flush chain inet lightmill {0}\n",
      direction);
  if (percent > 0) {
    const std::string some = percent < 100 ? fmt::format("numgen random mod 100 < {} ", percent) : "";
    rules += fmt::format("add rule inet lightmill {} {}drop\n", direction, some);
  }
  return rules;
}

}  // namespace

std::optional<std::string> Networks::missing() {
  if (::geteuid() != 0) {
    return "network namespaces need root";
  }
  for (const char* const program : {kIp, kNft}) {
    if (::access(program, X_OK) != 0) {
      return fmt::format("there is no {}", program);
    }
  }
  std::optional<std::string> why;
  std::thread([&why] {
    if (!enter_own_network()) {
      why = fmt::format("this kernel or container cannot create network namespaces: {}", std::strerror(errno));
      return;
    }
    for (const CommandResult& each : {run_command({kNft, loss_rules("input", 10) + loss_rules("output", 100)}),
                                      ip("link add lm0 type bridge"), ip("link add lm1 type veth peer name lm2")}) {
      if (each.exit_code != 0) {
        why = "this kernel lacks features for virtual networks: " + each.err;
      }
    }
  }).join();
  return why;
}

Networks::Networks(int hosts)
    : name_(fmt::format("lm{}", ::getpid())), hosts_(hosts), before_(::open("/proc/thread-self/ns/net", O_CLOEXEC)) {
  LM_CHECK(before_ >= 0 && enter_own_network());
  expect_ip("link set lo up");
  expect_ip(fmt::format("link add {} type bridge", name_));
  expect_ip(fmt::format("addr add {}/24 dev {}", address(), name_));
  expect_ip(fmt::format("link set {} up", name_));
  for (int host = 0; host < hosts_; ++host) {
    const std::string inside = host_name(host), link = link_name(host);
    expect_ip("netns add " + inside);
    expect_ip(fmt::format("link add {} type veth peer name eth0 netns {}", link, inside));
    expect_ip(fmt::format("link set {} master {} up", link, name_));
    expect_ip(fmt::format("-n {} addr add 10.77.0.{}/24 dev eth0", inside, 2 + host));
    expect_ip(fmt::format("-n {} link set eth0 up", inside));
    expect_ip(fmt::format("-n {} link set lo up", inside));
  }
}

Networks::~Networks() {
  for (int host = 0; host < hosts_; ++host) {
    ip("netns del " + host_name(host));
  }
  EXPECT_EQ(::setns(before_, CLONE_NEWNET), 0);
  ::close(before_);
}

std::string Networks::host_name(int host) const {
  return fmt::format("{}h{}", name_, host);
}

std::string Networks::link_name(int host) const {
  return fmt::format("{}v{}", name_, host);
}

std::vector<std::string> Networks::on_host(int host) const {
  return {kIp, "netns", "exec", host_name(host)};
}

void Networks::cut(int host) {
  expect_ip(fmt::format("link set {} down", link_name(host)));
}

void Networks::mend(int host) {
  expect_ip(fmt::format("link set {} up", link_name(host)));
}

void Networks::lose(int host, const std::string& direction, int percent) {
  std::vector<std::string> command = on_host(host);
  command.insert(command.end(), {kNft, loss_rules(direction, percent)});
  const CommandResult result = run_command(command);
  EXPECT_EQ(result.exit_code, 0) << result.err;
}

}  // namespace lightmill::test

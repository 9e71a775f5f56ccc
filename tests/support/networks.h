// Virtual hosts on this machine: network namespaces on a bridge. Their links can be cut and can lose packets.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lightmill::test {

/// Moves this process, and the threads that it starts from now on, to a network of its own: a bridge with hosts behind
/// it. Everything is removed at the end of the scope. The names of the networks are in a mount namespace, where this
/// process stays. So nothing is left if it is killed.
class Networks {
 public:
  /// Why this machine cannot have one (not root, no kernel support), or nothing.
  static std::optional<std::string> missing();

  explicit Networks(int hosts);
  ~Networks();
  Networks(const Networks&) = delete;
  Networks& operator=(const Networks&) = delete;

  /// This process's address on the bridge.
  static std::string address() { return "10.77.0.1"; }
  /// The command that starts a program on a host (0, 1, …). The program follows it.
  std::vector<std::string> on_host(int host) const;

  // These affect a host's link.
  void cut(int host);
  void mend(int host);
  /// Drops `percent` of the packets that the host sends or receives, at random.
  void lose_said(int host, int percent) { lose(host, "output", percent); }
  void lose_heard(int host, int percent) { lose(host, "input", percent); }

 private:
  std::string host_name(int host) const;
  std::string link_name(int host) const;
  void lose(int host, const std::string& direction, int percent);

  const std::string name_;
  const int hosts_;
  int before_ = -1;  ///< the original network namespace of the process
};

}  // namespace lightmill::test

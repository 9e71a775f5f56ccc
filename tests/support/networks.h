// Hosts of one's own on this machine: network namespaces on a bridge, whose links can be cut, and lose packets.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace lightmill::test {

/// This process moves to a network of its own while it lives, with the threads that it starts from now on: a bridge,
/// and hosts behind it. All goes at the end of the scope.
class Networks {
 public:
  /// Why there can be none here (not root, no kernel support), if so.
  static std::optional<std::string> missing();

  explicit Networks(int hosts);
  ~Networks();
  Networks(const Networks&) = delete;
  Networks& operator=(const Networks&) = delete;

  /// This process's address on the bridge.
  static std::string address() { return "10.77.0.1"; }
  /// The command that starts a program on a host, 0 on, with the program to follow.
  std::vector<std::string> on_host(int host) const;

  // Of a host's link:
  void cut(int host);
  void mend(int host);
  /// What the host says gets lost, or what it is told; `percent` of the packets, drawn at random.
  void lose_said(int host, int percent) { lose(host, "output", percent); }
  void lose_heard(int host, int percent) { lose(host, "input", percent); }

 private:
  std::string host_name(int host) const;
  std::string link_name(int host) const;
  void lose(int host, const std::string& direction, int percent);

  const std::string name_;
  const int hosts_;
  int before_ = -1;  ///< the network that the process comes from
};

}  // namespace lightmill::test

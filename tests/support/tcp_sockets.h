// The kernel's list of the TCP sockets of this network namespace. Tests wait for changes in it that neither end
// reports.
#pragma once

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace lightmill::test {

/// An IPv4 socket.
struct TcpSocket {
  unsigned local_port = 0, remote_port = 0;
  bool connecting = false;         ///< the SYN is not answered yet
  std::uint64_t unsent_bytes = 0;  ///< written, and not yet acknowledged by the other end
  std::uint64_t unread_bytes = 0;  ///< received, and not yet read
};

inline std::vector<TcpSocket> tcp_sockets() {
  std::vector<TcpSocket> sockets;
  std::ifstream list("/proc/net/tcp");
  std::string line;
  std::getline(list, line);  // column names
  while (std::getline(list, line)) {
    constexpr unsigned kSynSent = 2;  // from the kernel's tcp_states.h
    unsigned state = 0, unsent = 0, unread = 0;
    TcpSocket socket;
    if (std::sscanf(line.c_str(), "%*d: %*8x:%4x %*8x:%4x %2x %8x:%8x", &socket.local_port, &socket.remote_port, &state,
                    &unsent, &unread) == 5) {
      socket.connecting = state == kSynSent;
      socket.unsent_bytes = unsent;
      socket.unread_bytes = unread;
      sockets.push_back(socket);
    }
  }
  return sockets;
}

}  // namespace lightmill::test

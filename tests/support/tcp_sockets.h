// The TCP sockets of this network, as the kernel lists them: what a test can wait for where neither end says how far it
// is.
#pragma once

#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace lightmill::test {

/// One of IPv4.
struct TcpSocket {
  unsigned local_port = 0, remote_port = 0;
  bool connecting = false;         ///< it has asked, and has no answer yet
  std::uint64_t unsent_bytes = 0;  ///< that its owner has written, and the other end's kernel has not taken
  std::uint64_t unread_bytes = 0;  ///< that have arrived, and its owner has not read
};

inline std::vector<TcpSocket> tcp_sockets() {
  std::vector<TcpSocket> sockets;
  std::ifstream list("/proc/net/tcp");
  std::string line;
  std::getline(list, line);  // the names of the columns
  while (std::getline(list, line)) {
    constexpr unsigned kSynSent = 2;  // of the kernel's tcp_states.h
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

// A connection to another program's port. Every wait has a time limit, and can be woken.
#pragma once

#include <functional>
#include <future>
#include <memory>
#include <string>

#include "common/base/address.h"
#include "common/base/clock.h"
#include "common/base/status.h"

struct addrinfo;

namespace lightmill::cli {

/// Ends the current wait, or the next one. Thread-safe.
class WakeUp {
 public:
  WakeUp();
  ~WakeUp();
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;
  void wake() const;
  void clear() const;
  int fd() const { return fd_; }

 private:
  int fd_;
};

/// For one thread. Other threads may only wake it. Received bytes are dropped.
class OutgoingConnection {
 public:
  /// `timeout`: the time limit of the name lookup, then of each address, and then of the other side while it accepts
  /// no bytes. `clock` outlives this.
  OutgoingConnection(HostPort address, Duration timeout, const Clock& clock)
      : address_(std::move(address)), timeout_(timeout), clock_(clock), wake_up_(std::make_shared<WakeUp>()) {}
  ~OutgoingConnection() { close(); }
  OutgoingConnection(const OutgoingConnection&) = delete;
  OutgoingConnection& operator=(const OutgoingConnection&) = delete;

  const HostPort& address() const { return address_; }
  /// Ends the current wait, or the next one if there is none. May be called from any thread.
  void wake() const { wake_up_->wake(); }

  /// Tries the name's addresses one after the other. UNAVAILABLE has the reason. CANCELLED once `stopped`, which is
  /// asked at each wake-up.
  Status open(const std::function<bool()>& stopped);
  void close();
  /// Adds bytes to send. They are sent during waits, after all earlier bytes.
  void give(std::string bytes);
  bool all_taken() const { return taken_ == bytes_.size(); }
  /// Waits until some bytes are sent, it is woken, or `until`. May return earlier. UNAVAILABLE once the other side has
  /// closed, or has accepted no bytes for too long.
  Status wait(Time until);

 private:
  struct FreeAddresses {
    void operator()(addrinfo* list) const;
  };
  using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

  static Result<Addresses> look_up(const HostPort& address);
  Result<Addresses> addresses(const std::function<bool()>& stopped);
  Status open(const addrinfo& address, const std::function<bool()>& stopped);
  short poll(short events, Time until);
  Status receive();
  Status send();

  const HostPort address_;
  const Duration timeout_;
  const Clock& clock_;
  std::shared_ptr<WakeUp> wake_up_;           ///< shared with the lookup, which may outlive this
  std::future<Result<Addresses>> looked_up_;  ///< in progress, or not yet taken
  int socket_ = -1;                           ///< -1: closed
  std::string bytes_;
  std::size_t taken_ = 0;  ///< bytes of `bytes_` already sent
  Time last_taken_{};      ///< when bytes were last sent, or given
};

}  // namespace lightmill::cli

// A connection to another program's port that keeps nobody waiting: every wait has an end, and can be woken.
#pragma once

#include <chrono>
#include <functional>
#include <future>
#include <memory>
#include <string>

#include "common/base/address.h"
#include "common/base/clock.h"
#include "common/base/status.h"

struct addrinfo;

namespace lightmill::cli {

/// Ends what waits for it, now or next. Thread-safe.
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

/// For one thread; others may only wake it. What the other side says is dropped.
class OutgoingConnection {
 public:
  using Moment = std::chrono::steady_clock::time_point;
  static Moment now() { return std::chrono::steady_clock::now(); }

  /// `patience`: how long the lookup of the name may take, then each of its addresses, and then how long the other side
  /// may take nothing of what it is given.
  OutgoingConnection(HostPort address, Duration patience)
      : address_(std::move(address)), patience_(patience), wake_up_(std::make_shared<WakeUp>()) {}
  ~OutgoingConnection() { close(); }
  OutgoingConnection(const OutgoingConnection&) = delete;
  OutgoingConnection& operator=(const OutgoingConnection&) = delete;

  const HostPort& address() const { return address_; }
  /// Ends a wait, or the next one if there is none. From any thread.
  void wake() const { wake_up_->wake(); }

  /// Tries the name's addresses, one after the other. UNAVAILABLE says why not in words; CANCELLED once `stopped`,
  /// which is asked whenever it is woken.
  Status open(const std::function<bool()>& stopped);
  void close();
  /// Bytes to be sent while it waits, once all before have been taken.
  void give(std::string bytes);
  bool all_taken() const { return taken_ == bytes_.size(); }
  /// Waits until some are taken, it is woken, or `until`; it may return earlier. UNAVAILABLE once the other side has
  /// closed, or has taken nothing for too long.
  Status wait(Moment until);

 private:
  struct FreeAddresses {
    void operator()(addrinfo* list) const;
  };
  using Addresses = std::unique_ptr<addrinfo, FreeAddresses>;

  static Result<Addresses> look_up(const HostPort& address);
  Result<Addresses> addresses(const std::function<bool()>& stopped);
  Status open(const addrinfo& address, const std::function<bool()>& stopped);
  short poll(short events, Moment until);
  Status receive();
  Status send();

  const HostPort address_;
  const Duration patience_;
  std::shared_ptr<WakeUp> wake_up_;           ///< the lookup's too, which may outlive this
  std::future<Result<Addresses>> looked_up_;  ///< under way, or not yet taken
  int socket_ = -1;                           ///< -1: closed
  std::string bytes_;
  std::size_t taken_ = 0;  ///< of them
  Moment last_taken_{};    ///< or given
};

}  // namespace lightmill::cli

// Stream between one life of a worker and one life of a coordinator.
#pragma once

#include <string>

#include "common/base/clock.h"
#include "common/base/ids.h"

namespace lightmill::simulation {

struct Stream {
  std::size_t worker = 0;
  std::string name;  ///< of the worker when it connected
  std::uint64_t worker_life = 0;
  std::uint64_t server_life = 0;
  SessionId session;
  bool broken = false;
  bool lingers = false;  ///< broken for the worker; messages that it sent still come
  bool said_hello = false;
  Time cut_up, cut_down;    ///< nothing comes through until then
  Time last_up, last_down;  ///< when the last message arrives: order within a direction is kept
};

}  // namespace lightmill::simulation

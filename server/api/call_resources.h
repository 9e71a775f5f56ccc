// What gRPC calls share: threads besides gRPC's own, and turns to read requests. gRPC has few threads, and all streams of
// workers need them.
#pragma once

#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>

#include "server/api/request_reads.h"

namespace lightmill {

/// Outlives the server. Thread-safe.
struct CallResources {
  boost::asio::thread_pool requests{2};  ///< read large requests, such as scenes
  boost::asio::thread_pool disk{2};      ///< may wait for the disk or the database
  RequestReads reads;
};

}  // namespace lightmill

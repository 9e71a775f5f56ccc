// Threads for slow work, besides gRPC's own. gRPC has few threads, and all streams of workers need them.
#pragma once

#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>

namespace lightmill {

/// Outlives the server. Thread-safe.
struct CallThreads {
  boost::asio::thread_pool requests{2};  ///< read large requests, such as scenes
  boost::asio::thread_pool disk{2};      ///< may wait for the disk or the database
};

}  // namespace lightmill

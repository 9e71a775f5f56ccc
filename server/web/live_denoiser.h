// Denoised pictures of the films that pages watch. One thread makes them, one after the other, with a quarter of a core.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string_view>
#include <thread>
#include <vector>

#include "common/base/mutex.h"
#include "server/assembly/denoised_tiles.h"
#include "server/runtime/farm_loop.h"

namespace lightmill {

/// Runs a function on the web thread. Thread-safe.
using OnWebThread = std::function<void(std::function<void()>)>;

/// Name of the denoised picture among the layers that a page can ask for. Films have no layer of this name.
inline constexpr std::string_view kDenoisedLayer = "denoised";

/// Used on the web thread.
class LiveDenoiser {
 public:
  /// The denoised picture of a version of the film.
  struct Picture {
    std::uint64_t film_version = 0;
    std::vector<DenoisedTile> tiles;  ///< empty if the version is the known one
  };
  /// Called on the web thread.
  using Done = std::function<void(const Result<Picture>&)>;

  LiveDenoiser(FarmLoop& loop, OnWebThread on_web_thread);
  /// Waits for the current picture. Orders that wait are dropped.
  ~LiveDenoiser();
  LiveDenoiser(const LiveDenoiser&) = delete;
  LiveDenoiser& operator=(const LiveDenoiser&) = delete;

  /// An order without its user is dropped.
  struct Order {
    JobId job;
    LayerSlice features;      ///< place of this layer in the job's film
    std::uint64_t known = 0;  ///< a version of the film that needs no picture
    std::weak_ptr<const void> user;
    Done done;
  };
  /// Denoises the film as it is when the order's turn comes.
  void add(Order order);

 private:
  struct Desk;
  void start_next();
  void run();

  FarmLoop& loop_;
  const OnWebThread on_web_thread_;
  std::deque<Order> waiting_;
  bool busy_ = false;  ///< with an order, or resting after it
  /// Lets functions on other threads notice that the denoiser is gone.
  const std::shared_ptr<LiveDenoiser*> self_ = std::make_shared<LiveDenoiser*>(this);
  const std::shared_ptr<Desk> desk_;
  std::thread thread_;
};

}  // namespace lightmill

// Another program's window that shows a job's picture as it gets better: tev or HDRView, over a connection.
#pragma once

#include <map>
#include <string>
#include <thread>
#include <vector>

#include "client/cli/console.h"
#include "common/base/address.h"
#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill::cli {

/// Sends changed tiles from a thread of its own: a slow viewer gets the newest of each, and keeps nobody waiting. Where
/// nobody listens, or the viewer goes away, the console is told once, and it is tried again.
class TevViewer {
 public:
  TevViewer(HostPort address, std::uint64_t job, const Console& console);
  /// Sends what is left, for so long as kLastWords.
  ~TevViewer();
  TevViewer(const TevViewer&) = delete;
  TevViewer& operator=(const TevViewer&) = delete;

  /// Takes the tiles of a message.
  void update(const v1::WatchJobResponse& response);

 private:
  struct Tile {
    int width = 0, height = 0;
    std::vector<float> planes;
    bool sent = false;
  };
  void run();
  bool connect();
  bool send(const std::string& packet);
  /// The next packet; empty if there is nothing to send.
  std::string next_packet();
  void disconnect(const std::string& why);

  const HostPort address_;
  const Console& console_;
  int socket_ = -1;
  bool told_ = false;  ///< that nobody listens
  Mutex mutex_;
  CondVar changed_;
  std::string name_ LM_GUARDED_BY(mutex_);
  int width_ LM_GUARDED_BY(mutex_) = 0, height_ LM_GUARDED_BY(mutex_) = 0;
  bool created_ LM_GUARDED_BY(mutex_) = false;                       ///< on this connection
  std::map<std::pair<int, int>, Tile> tiles_ LM_GUARDED_BY(mutex_);  ///< by y and x in the picture
  bool stopping_ LM_GUARDED_BY(mutex_) = false;
  std::thread thread_;  ///< the last: it uses the others
};

}  // namespace lightmill::cli

// Live view of a job's picture in the window of tev or HDRView, over a connection.
#pragma once

#include <optional>
#include <string>
#include <thread>

#include "client/cli/console.h"
#include "client/cli/outgoing_connection.h"
#include "client/tev/tev_picture.h"
#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill::cli {

struct TevPauses {
  Duration retry = std::chrono::seconds(1);    ///< before the next try
  Duration lasting = std::chrono::seconds(3);  ///< a connection that lasts this long has a viewer
  Duration timeout = std::chrono::seconds(5);  ///< time limit for a viewer that does not answer, or accepts no bytes
};

/// Sends changed tiles from a thread of its own. A slow viewer gets the newest version of each tile, and delays no
/// caller. If no viewer listens, or it goes away, the console says so once and the thread retries. A viewer that comes
/// back gets the whole picture.
class TevViewer {
 public:
  /// `clock` outlives this.
  TevViewer(HostPort address, std::uint64_t job, const Console& console, const TevPauses& pauses = {},
            const Clock& clock = system_clock());
  /// Ends at once, even if the viewer lacks tiles.
  ~TevViewer();
  TevViewer(const TevViewer&) = delete;
  TevViewer& operator=(const TevViewer&) = delete;

  /// Takes the tiles of a message.
  void update(const v1::WatchJobResponse& response);
  /// Returns true once the viewer was sent everything. Returns false if there is no viewer, it accepts no bytes, or
  /// stop() was called. No update may follow.
  bool finish();
  /// Stops sending. finish() returns at once. May be called from any thread.
  void stop();

 private:
  enum class Phase { showing, finishing, stopped };

  void run();
  /// Sends until all is sent or stop() was called (OK), or the viewer is gone (an error with the reason).
  Status serve();
  std::string next_packet();
  void advance_to(Phase phase);
  Phase phase();
  void report_found();
  void report_missing(const Status& why);
  void report_incomplete(const Status& why);

  const std::uint64_t job_;
  const Console& console_;
  const TevPauses pauses_;
  const Clock& clock_;
  OutgoingConnection connection_;  ///< used by the thread; woken when the members below change
  bool reported_missing_ = false;  ///< used by the thread: whether the last report was a missing viewer
  bool sent_all_ = false;          ///< used by the thread
  Mutex mutex_;
  std::optional<TevPicture> picture_ LM_GUARDED_BY(mutex_);  ///< empty until its size is known
  Phase phase_ LM_GUARDED_BY(mutex_) = Phase::showing;
  std::thread thread_;  ///< last, because it uses the other members
};

}  // namespace lightmill::cli

// Another program's window that shows a job's picture as it gets better: tev or HDRView, over a connection.
#pragma once

#include <optional>
#include <string>
#include <thread>

#include "client/cli/console.h"
#include "client/cli/outgoing_connection.h"
#include "client/tev/tev_picture.h"
#include "common/base/mutex.h"
#include "lightmill/v1/render_service.pb.h"

namespace lightmill::cli {

struct TevPauses {
  Duration retry = std::chrono::seconds(1);     ///< before it is tried again
  Duration lasting = std::chrono::seconds(3);   ///< a connection that holds for so long has a viewer at its end
  Duration patience = std::chrono::seconds(5);  ///< a viewer that does not answer, or takes nothing, is as good as gone
};

/// Sends changed tiles from a thread of its own: a slow viewer gets the newest of each, and keeps nobody waiting. Where
/// nobody listens, or the viewer goes away, the console is told once, and it is tried again; whoever comes back gets
/// all of the picture.
class TevViewer {
 public:
  TevViewer(HostPort address, std::uint64_t job, const Console& console, const TevPauses& pauses = {});
  /// Ends at once, whatever the viewer lacks.
  ~TevViewer();
  TevViewer(const TevViewer&) = delete;
  TevViewer& operator=(const TevViewer&) = delete;

  /// Takes the tiles of a message.
  void update(const v1::WatchJobResponse& response);
  /// Returns once the viewer has been sent everything (true), or is not there, takes nothing any more or stop() was
  /// called (false). No update may follow.
  bool finish();
  /// Nothing more is sent: finish() returns at once. From any thread.
  void stop();

 private:
  enum class Phase { showing, finishing, stopped };

  void run();
  /// Sends until all is done (OK, also when stopped) or the viewer is gone, and why.
  Status serve();
  std::string next_packet();
  void go_on_to(Phase phase);
  Phase phase();
  void tell_found();
  void tell_missing(const Status& why);
  void tell_incomplete(const Status& why);

  const std::uint64_t job_;
  const Console& console_;
  const TevPauses pauses_;
  OutgoingConnection connection_;  ///< the thread's; it is woken when what follows has changed
  bool told_missing_ = false;      ///< the thread's: the last that the console heard
  bool sent_all_ = false;          ///< the thread's
  Mutex mutex_;
  std::optional<TevPicture> picture_ LM_GUARDED_BY(mutex_);  ///< once its size is known
  Phase phase_ LM_GUARDED_BY(mutex_) = Phase::showing;
  std::thread thread_;  ///< the last: it uses the others
};

}  // namespace lightmill::cli

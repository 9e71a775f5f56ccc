// The worker's main thread: passes events to the session, and performs its actions.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/base/clock.h"
#include "common/base/mutex.h"
#include "worker/inspect/inspector.h"
#include "worker/render/preparer.h"
#include "worker/render/render_pool.h"
#include "worker/rpc/coordinator_link.h"
#include "worker/session/session.h"

namespace lightmill {

struct WorkerOptions {
  CoordinatorAddress farm;
  SessionConfig session;
  SceneCacheLimits scenes;
  SceneLimits scene;
  DecoderOptions decoder;
  std::filesystem::path reader = ReaderOptions().program;  ///< the program that reads uploaded scenes
  std::uint64_t asset_bytes = std::uint64_t{1} << 30;      ///< limit of cached assets
  std::function<void()> connected = {};  ///< called once, at the first connection; all threads run by then
  RenderPool::Tamper tamper = {};        ///< only for tests of dishonest workers
};

class WorkerLoop {
 public:
  WorkerLoop(const WorkerOptions& options, const Clock& clock);
  /// Runs until the session ends. Returns an error if the coordinator ended it.
  Status run();
  /// Finishes or gives back current work, then leaves. Thread-safe.
  void drain();

 private:
  using Event = std::function<void(Time now)>;
  void post(Event event);
  std::vector<Event> wait();
  void perform();
  void perform(const OpenStream&) { open_at_ = clock_.now() + jitter(); }
  void perform(const CloseStream&) { link_.close(); }
  void perform(const SendMessage& action);
  void perform(const PrepareJob& action);
  void perform(const ForgetJob& action);
  void perform(const RenderTile& action);
  void perform(const StopTile& action) { pool_.stop(action.ticket); }
  void perform(const RunPilot& action) { preparer_.add(action.grant); }
  void perform(const DropPilot& action) { preparer_.drop(action.lease); }
  void perform(const RunInspection& action) { inspector_.add(action.grant); }
  void perform(const DropInspection&) { inspector_.drop(); }
  void perform(const ResultStored& action);
  void perform(const LogNotice& action);
  void perform(const Exit& action);
  void open_if_due(Time now);
  void job_prepared(const JobDescription& description, const Result<PreparedJob>& prepared, Time now);
  void tile_rendered(RenderedTile tile, Time now);
  void pilot_done(LeaseId lease, const Result<PilotReport>& report, Time now);
  void stream_broke(const std::string& address, const Status& status, Time now);
  void log_failure(const std::string& address, const Status& status, bool refused);
  void explain(const std::string& address, const Status& status);
  void log_trouble(const std::string& address, const std::string& why);
  Duration jitter();
  LinkHandlers link_handlers();

  const Clock& clock_;
  std::function<void()> connected_;
  const Duration refused_most_;
  Session session_;
  SessionActions actions_;
  struct Job {
    std::shared_ptr<const JobDescription> description;
    std::optional<PreparedJob> prepared;
  };
  std::map<JobId, Job> jobs_;
  std::optional<Time> open_at_;  ///< when to open the requested stream
  std::uint64_t stream_ = 0;     ///< number of the current stream
  bool stream_open_ = false;     ///< not disconnected yet
  int failures_ = 0;             ///< failed attempts to connect in a row
  struct Trouble {
    std::optional<std::string> status, before;  ///< messages of the last two different failures
    std::string why;                            ///< the last reason in the log
  };
  std::string name_in_log_;                  ///< the last name of this worker that its log has
  std::map<std::string, Trouble> troubles_;  ///< by address, since the last connection
  bool explaining_now_ = false;              ///< explaining_ has not posted its result yet
  std::uint64_t random_ = 0;                 ///< state of the jitter's generator
  std::optional<Exit> exit_;
  std::optional<Time> exit_by_;

  Mutex mutex_;
  CondVar changed_;
  std::vector<Event> events_ LM_GUARDED_BY(mutex_);

  // These threads post events, so they end first.
  CoordinatorLink link_;
  std::jthread explaining_;  ///< explains why there is no connection; uses link_
  AssetCache assets_;
  Preparer preparer_;
  Inspector inspector_;
  RenderPool pool_;
};

}  // namespace lightmill

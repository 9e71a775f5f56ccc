// The worker's connection to a coordinator: one stream of messages, and assets to download.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "common/base/digest.h"
#include "common/base/mutex.h"
#include "common/base/status.h"
#include "common/farm/messages.h"
#include "common/security/caller.h"
#include "worker/state/state_folder.h"

namespace lightmill {

class LinkStream;

/// What happens on the stream that `open` numbered; called from gRPC's threads. Each number ends with one
/// `disconnected`.
struct LinkHandlers {
  std::function<void(std::uint64_t stream, const std::string& address)> connected;
  std::function<void(std::uint64_t stream, CoordinatorMessage message)> message;
  std::function<void(std::uint64_t stream, const std::string& address, const Status& status)> disconnected;
};

inline constexpr const char* kEnrolFileOption = "--enrol-file";

/// How a worker gets a token of its own, and where it keeps it.
struct EnrolmentFiles {
  std::string file;              ///< has an enrolment token; read only when the worker enrols
  StateFolder* state = nullptr;  ///< outlives the link
  std::string host;              ///< what the machine calls itself
};

/// Where the farm is, and how it knows the worker.
struct FarmAddress {
  std::vector<std::string> servers;  ///< HOST:PORT; each attempt takes the next one
  CallerFiles caller;                ///< read for each attempt, so that renewed ones come into use
  /// Without a token in `caller`. A worker whose own token is refused enrols again.
  std::optional<EnrolmentFiles> enrolment = {};
};

/// Thread-safe. At most one stream at a time.
class FarmLink {
 public:
  FarmLink(FarmAddress farm, LinkHandlers handlers);
  /// Ends the stream; no handler is called afterwards.
  ~FarmLink();

  /// Starts to open a stream and returns its number. An earlier one has been disconnected, as its handler has been
  /// told, which has returned when this does: not to be called by a handler.
  std::uint64_t open();
  /// Queues a message; it is dropped if the stream is down (the session sends it again on the next).
  void send(std::shared_ptr<const WorkerMessage> message);
  /// Says that nothing more comes, once everything queued has been written. Transfers under way are given up.
  void close();

  /// Why a stream to `server` broke, in words: looks into it if the failure says only that there was no connection,
  /// which may take some seconds.
  std::string explain(const std::string& server, const Status& failure) const;

  /// Downloads an asset from the coordinator of the last stream; blocks. UNAVAILABLE, also where it
  /// has been lost: it may come again.
  Result<std::string> download(const Sha256& digest);
  /// Uploads those of the assets that the coordinator lacks; blocks. As download, what uploads are refused with, and
  /// what `go_on` says, which is asked before each.
  Status upload_missing(const std::map<Sha256, std::string>& assets, const std::function<Status()>& go_on);

 private:
  struct Connection;
  Result<CallerTexts> read_caller() const;
  LinkHandlers watching_refusals(LinkHandlers handlers);
  bool has_to_enrol();
  Status enrol(const std::string& server);
  void open_stream(std::uint64_t number, const std::string& server);
  std::shared_ptr<Connection> connect(const std::string& server, CallerTexts caller) const;
  /// The connection, of which this is a call until the end of `run`: close() gives it up. UNAVAILABLE.
  template <class Run>
  Status call(std::chrono::seconds limit, const Run& run);
  Status upload(const Sha256& digest, ByteView bytes);

  const FarmAddress farm_;
  const LinkHandlers handlers_;
  Mutex mutex_;
  std::shared_ptr<Connection> connection_ LM_GUARDED_BY(mutex_);
  std::shared_ptr<LinkStream> stream_ LM_GUARDED_BY(mutex_);
  std::uint64_t streams_ LM_GUARDED_BY(mutex_) = 0;
  bool closed_ LM_GUARDED_BY(mutex_) = false;
  bool token_refused_ LM_GUARDED_BY(mutex_) = false;  ///< the worker's own
  std::jthread enrolling_;                            ///< enrols, then opens the stream
};

}  // namespace lightmill

// The worker's connection to a coordinator: one stream of messages, and transfers of assets.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
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

/// Events of the stream with the number that open() returned. gRPC's threads call them. Each stream ends with one
/// `disconnected`.
struct LinkHandlers {
  std::function<void(std::uint64_t stream, const std::string& address)> connected;
  std::function<void(std::uint64_t stream, CoordinatorMessage message)> message;
  std::function<void(std::uint64_t stream, const std::string& address, const Status& status)> disconnected;
};

inline constexpr const char* kEnrolFileOption = "--enrol-file";

/// The enrolment of a worker: the enrolment token, and the place of the token that the worker gets.
struct EnrolmentFiles {
  std::string file;              ///< has an enrolment token; read only when the worker enrols
  StateFolder* state = nullptr;  ///< outlives the link
  std::string host;              ///< the machine's own name
};

/// The farm's addresses and the worker's credentials.
struct CoordinatorAddress {
  std::vector<std::string> servers;  ///< HOST:PORT; each attempt takes the next one
  CallerFiles caller;                ///< read for each attempt, so that renewed files are used
  /// Only without a token in `caller`. A worker whose own token is refused alternates between
  /// enrolment and its own token.
  std::optional<EnrolmentFiles> enrolment = {};
};

/// Thread-safe. Has one stream at most.
class CoordinatorLink {
 public:
  CoordinatorLink(CoordinatorAddress farm, LinkHandlers handlers);
  /// Ends the stream. No handler is called afterwards.
  ~CoordinatorLink();

  /// Starts to open a stream, and returns its number. Before it returns, an earlier stream is disconnected and its
  /// handler has returned. So handlers must not call it.
  std::uint64_t open();
  /// Queues a message. It is dropped if the stream is down. The session sends it again on the next one.
  void send(std::shared_ptr<const WorkerMessage> message);
  /// Whether the next stream begins with an enrolment, because the farm has refused the worker's own token. It should
  /// be opened soon.
  bool enrols_next();
  /// Ends sending after all queued messages are written. Aborts transfers.
  void close();

  /// Explains why a stream to `server` broke. If the failure says only that there was no connection, it tests the
  /// connection, which may take seconds.
  std::string explain(const std::string& server, const Status& failure) const;

  /// Downloads an asset from the coordinator of the last stream. Blocks. UNAVAILABLE also if the asset is lost, because
  /// clients may send it again.
  Result<std::string> download(const Sha256& digest);
  /// The assets that the coordinator lacks. Blocks. Returns errors like download().
  Result<std::vector<Sha256>> missing(std::span<const Sha256> digests);
  /// Uploads an asset. Blocks. Returns errors like download(), and refusals of uploads.
  Status upload(const Sha256& digest, ByteView bytes);

 private:
  struct Connection;
  Result<CallerTexts> read_caller() const;
  LinkHandlers watching_refusals(LinkHandlers handlers);
  bool has_to_enrol();
  Status enrol(const std::string& server);
  void open_stream(std::uint64_t number, const std::string& server);
  std::shared_ptr<Connection> connect(const std::string& server, CallerTexts caller) const;
  /// Runs a call on the connection; close() aborts it. UNAVAILABLE.
  template <class Run>
  Status call(std::chrono::seconds limit, const Run& run);

  const CoordinatorAddress farm_;
  const LinkHandlers handlers_;
  const LinkHandlers stream_handlers_;  ///< also detect that the farm refuses the worker's own token
  Mutex mutex_;
  std::shared_ptr<Connection> connection_ LM_GUARDED_BY(mutex_);
  std::shared_ptr<LinkStream> stream_ LM_GUARDED_BY(mutex_);
  std::uint64_t streams_ LM_GUARDED_BY(mutex_) = 0;
  bool closed_ LM_GUARDED_BY(mutex_) = false;
  bool token_refused_ LM_GUARDED_BY(mutex_) = false;  ///< the worker's own token, at the last try
  std::jthread enrolling_;                            ///< enrols, then opens the stream
};

}  // namespace lightmill

// Upload of an asset over HTTP, written in pieces. Only the disk threads wait for the disk.
#pragma once

#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>

#include <functional>

#include "server/access/rights.h"
#include "server/runtime/access_control.h"
#include "server/runtime/traffic.h"
#include "server/store/asset_store.h"
#include "server/web/http_body.h"

namespace lightmill {

/// References to parts of the connection. It lives as long as `done`.
struct UploadContext {
  WebStream& stream;
  boost::beast::flat_buffer& buffer;
  AssetStore& assets;
  const AccessControl& access;
  boost::asio::thread_pool& disk;  ///< its threads may wait for the disk
  Traffic& traffic;
  Duration timeout;  ///< WebOptions::timeout
};

/// `whole`: the body was read to its end.
using UploadDone = std::function<void(const Status& status, bool whole)>;

/// Receives the body of an admitted call. `done` gets OK once the asset is stored durably, or an error of AssetStore.
/// If the connection ends or is too slow, `done` is destroyed without a call, and nothing is stored.
void receive_asset(const UploadContext& way, HeadParser&& head, const Sha256& digest, Call call, UploadDone done);

}  // namespace lightmill

// An asset on its way in over a connection: what comes is written piece by piece, and never off the disk's thread.
#pragma once

#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/flat_buffer.hpp>

#include <functional>

#include "server/access/rights.h"
#include "server/runtime/traffic.h"
#include "server/store/asset_store.h"
#include "server/web/http_body.h"

namespace lightmill {

/// Belongs to the connection, which lives as long as `done` does.
struct UploadWay {
  WebStream& stream;
  boost::beast::flat_buffer& buffer;
  AssetStore& assets;
  boost::asio::thread_pool& disk;  ///< its threads may wait for the disk
  Traffic& traffic;
};

/// `whole`: the body was read to its end.
using UploadDone = std::function<void(const Status& status, bool whole)>;

/// Takes in the body of a call that was admitted. `done` says whether the asset is in place, durably: errors as
/// AssetStore has them. It is let go without that where the connection ends before, or is too slow; then nothing stays.
void receive_asset(const UploadWay& way, HeadParser&& head, const Sha256& digest, Call call, UploadDone done);

}  // namespace lightmill

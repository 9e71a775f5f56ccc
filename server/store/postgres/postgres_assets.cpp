#include "server/store/postgres/postgres_assets.h"

#include <map>
#include <optional>
#include <vector>

#include "common/base/log.h"
#include "server/store/row_values.h"

namespace lightmill::postgres {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;
constexpr auto kAssetCallTimeout = std::chrono::seconds(30);
/// Connections at most. Uploads and downloads share them.
constexpr std::size_t kMaxSessions = 4;
constexpr int kMaxTries = 3;
constexpr std::string_view kUniqueViolation = "23505";

/// Lends sessions to one user at a time. Thread-safe.
class SessionPool {
 public:
  explicit SessionPool(Target target) : target_(std::move(target)) {}

  std::unique_ptr<Session> borrow() {
    const MutexLock lock(mutex_);
    while (idle_.empty() && lent_ == kMaxSessions) {
      changed_.wait(mutex_);
    }
    ++lent_;
    if (idle_.empty()) {
      return std::make_unique<Session>(target_, std::span<const char* const>(), kAssetCallTimeout);
    }
    std::unique_ptr<Session> session = std::move(idle_.back());
    idle_.pop_back();
    return session;
  }
  void give_back(std::unique_ptr<Session> session) {
    const MutexLock lock(mutex_);
    --lent_;
    idle_.push_back(std::move(session));
    changed_.notify_one();
  }

 private:
  const Target target_;
  Mutex mutex_;
  CondVar changed_;
  std::vector<std::unique_ptr<Session>> idle_ LM_GUARDED_BY(mutex_);
  std::size_t lent_ LM_GUARDED_BY(mutex_) = 0;
};

/// Borrows a session of the pool for a scope.
class Borrowed {
 public:
  explicit Borrowed(SessionPool& pool) : pool_(pool), session_(pool.borrow()) {}
  ~Borrowed() { pool_.give_back(std::move(session_)); }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;
  const std::string& last_state() const { return session_->last_state(); }

  Status run(const char* sql, const Parameters& parameters) { return query(sql, parameters).status(); }
  /// Reconnects if the connection has died since its last use.
  Result<Rows> query(const char* sql, const Parameters& parameters) {
    const bool was_connected = session_->connected();
    Result<Rows> rows = session_->query(sql, parameters);
    return !rows.ok() && was_connected && !session_->connected() ? session_->query(sql, parameters) : std::move(rows);
  }

 private:
  SessionPool& pool_;
  std::unique_ptr<Session> session_;
};

struct Entry {
  std::uint64_t id = 0;
  std::uint64_t size_bytes = 0;
};

class PostgresAssets final : public AssetStore {
 public:
  PostgresAssets(std::shared_ptr<Leadership> leadership, AssetLimits limits, std::map<Sha256, Entry> entries,
                 std::uint64_t total_bytes)
      : leadership_(std::move(leadership)),
        pool_(leadership_->target()),
        budget_(limits, total_bytes),
        entries_(std::move(entries)) {}

  Result<std::uint64_t> size(const Sha256& digest) const override {
    LM_ASSIGN_OR_RETURN(const Entry entry, find(digest));
    return entry.size_bytes;
  }
  std::vector<Sha256> digests() const override {
    const MutexLock lock(mutex_);
    std::vector<Sha256> all;
    for (const auto& [digest, entry] : entries_) {
      all.push_back(digest);
    }
    return all;
  }
  Status check_room(const Sha256& digest, const std::string& user, std::uint64_t bytes) const override {
    return budget_.check(digest, user, bytes);
  }
  Result<std::unique_ptr<Upload>> start_upload(const Sha256& digest, const std::string& user) override;
  Status attribute(const Sha256& digest, const std::string& user, UserLimit limit) override {
    const Result<std::uint64_t> bytes = size(digest);
    return bytes.ok() ? budget_.attribute(digest, user, *bytes, limit) : bytes.status();
  }
  Result<std::unique_ptr<Reader>> open_asset(const Sha256& digest) const override;
  std::uint64_t collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds) override;
  void forget(const Reader& damaged) override;
  std::uint64_t total_bytes() const override { return budget_.used_bytes(); }

 private:
  friend class PostgresUpload;
  Result<Entry> find(const Sha256& digest) const;
  /// Removes the rows of an asset.
  Status remove(Borrowed& session, std::uint64_t id) const {
    return session.run("WITH own AS MATERIALIZED (SELECT fence($1)) DELETE FROM assets USING own WHERE id = $2",
                       Parameters(leadership_->epoch(), id));
  }
  void insert(const Sha256& digest, Entry entry) {
    const MutexLock lock(mutex_);
    entries_.insert_or_assign(digest, entry);
  }
  /// True if this entry was there. An asset that was sent again is another entry, and stays.
  bool erase(const Sha256& digest, const Entry& entry) {
    const MutexLock lock(mutex_);
    const auto at = entries_.find(digest);
    const bool found = at != entries_.end() && at->second.id == entry.id;
    if (found) {
      entries_.erase(at);
    }
    return found;
  }
  /// If this coordinator is deposed, callers may find the new one: UNAVAILABLE.
  Status explain(const Status& status) const {
    const Status explained = leadership_->explain(status);
    return explained.code() == StatusCode::kFailedPrecondition ? unavailable("{}", message_of(explained)) : explained;
  }

  const std::shared_ptr<Leadership> leadership_;
  mutable SessionPool pool_;
  AssetBudget budget_;
  mutable Mutex mutex_;
  std::map<Sha256, Entry> entries_ LM_GUARDED_BY(mutex_);
};

class PostgresUpload final : public AssetStore::Upload {
 public:
  PostgresUpload(PostgresAssets& store, const Sha256& digest, std::string user)
      : store_(store), digest_(digest), user_(std::move(user)) {}
  ~PostgresUpload() override;
  PostgresUpload(const PostgresUpload&) = delete;
  PostgresUpload& operator=(const PostgresUpload&) = delete;
  Status append(ByteView bytes) override;
  Status finish() override;

 private:
  Status send_piece(std::string_view piece);
  void remove();

  PostgresAssets& store_;
  const Sha256 digest_;
  const std::string user_;
  std::optional<std::uint64_t> id_;  ///< set once the database has a row
  std::string unsent_;
  std::int64_t next_position_ = 0;
  std::uint64_t size_bytes_ = 0;
  Sha256Hasher hasher_;
  bool kept_ = false;
};

class PostgresReader final : public AssetStore::Reader {
 public:
  PostgresReader(SessionPool& pool, const Sha256& digest, Entry entry) : pool_(pool), digest_(digest), entry_(entry) {}
  const Sha256& digest() const { return digest_; }
  const Entry& entry() const { return entry_; }
  Result<std::string> next(std::size_t limit_bytes) override;

 private:
  SessionPool& pool_;
  const Sha256 digest_;
  const Entry entry_;
  std::int64_t next_position_ = 0;
  std::uint64_t fetched_bytes_ = 0;
  std::string piece_;
  std::size_t given_bytes_ = 0;  ///< of piece_
};

Result<Entry> PostgresAssets::find(const Sha256& digest) const {
  const MutexLock lock(mutex_);
  const auto entry = entries_.find(digest);
  if (entry == entries_.end()) {
    return not_found("there is no asset {}", digest.hex());
  }
  return entry->second;
}

// ---- writing ----

Result<std::unique_ptr<AssetStore::Upload>> PostgresAssets::start_upload(const Sha256& digest,
                                                                         const std::string& user) {
  return std::unique_ptr<Upload>(std::make_unique<PostgresUpload>(*this, digest, user));
}

PostgresUpload::~PostgresUpload() {
  if (!kept_) {
    remove();
    store_.budget_.release(user_, size_bytes_);
  }
}

/// The next coordinator removes what cannot be removed now.
void PostgresUpload::remove() {
  if (!id_) {
    return;
  }
  Borrowed session(store_.pool_);
  if (const Status status = store_.remove(session, *id_); !status.ok()) {
    spdlog::warn("the incomplete asset {} stays in the database until a coordinator starts: {}", digest_.hex(),
                 message_of(status));
  }
}

Status PostgresUpload::append(ByteView bytes) {
  LM_RETURN_IF_ERROR(store_.budget_.reserve(digest_, user_, size_bytes_, bytes.size()));
  size_bytes_ += bytes.size();
  hasher_.append(bytes);
  unsent_.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  while (unsent_.size() >= kPieceBytes) {
    LM_RETURN_IF_ERROR(send_piece(std::string_view(unsent_).substr(0, kPieceBytes)));
    unsent_.erase(0, kPieceBytes);
  }
  return ok_status();
}

Status PostgresUpload::send_piece(std::string_view piece) {
  Borrowed session(store_.pool_);
  const std::uint64_t epoch = store_.leadership_->epoch();
  if (!id_) {
    const Result<Rows> made = session.query(
        "WITH own AS MATERIALIZED (SELECT fence($1)) INSERT INTO assets (size_bytes, stored) SELECT 0, "
        "clock_timestamp() FROM own RETURNING id",
        Parameters(epoch));
    if (!made.ok()) {
      return store_.explain(made.status());
    }
    id_ = made->natural(0, 0);
  }
  // A piece that is sent twice, because the reply was lost, is stored once.
  return store_.explain(
      session.run("WITH own AS MATERIALIZED (SELECT fence($1)) INSERT INTO asset_pieces (asset, position, bytes) "
                  "SELECT $2, $3, $4 FROM own ON CONFLICT DO NOTHING",
                  Parameters(epoch, *id_, next_position_++, as_byte_view(piece))));
}

Status PostgresUpload::finish() {
  if (const Sha256 actual = hasher_.finish(); actual != digest_) {
    return invalid_argument("the {} bytes sent as asset {} have the digest {}", size_bytes_, digest_.hex(),
                            actual.hex());
  }
  if (!unsent_.empty() || !id_) {
    LM_RETURN_IF_ERROR(send_piece(unsent_));
  }
  const ByteView digest = stored::view_of(digest_.bytes);
  for (int tries = 0; tries < kMaxTries; ++tries) {
    Borrowed session(store_.pool_);
    const Status status = session.run(
        "WITH own AS MATERIALIZED (SELECT fence($1)) UPDATE assets SET digest = $3, size_bytes = $4, "
        "stored = clock_timestamp() FROM own WHERE id = $2",
        Parameters(store_.leadership_->epoch(), *id_, digest, size_bytes_));
    if (status.ok()) {
      kept_ = true;
      store_.insert(digest_, {*id_, size_bytes_});
      store_.budget_.stored(digest_, user_, size_bytes_);
      return status;
    }
    if (session.last_state() != kUniqueViolation) {
      return store_.explain(status);
    }
    // If another upload was first, the same bytes are in place, and this upload's bytes are removed. The stored asset
    // may be old, so it is marked as kept now. If it was deleted just now, the next attempt stores these bytes.
    (void)store_.keep(digest_);
    LM_ASSIGN_OR_RETURN(const Rows first,
                        session.query("SELECT id, size_bytes FROM assets WHERE digest = $1", Parameters(digest)));
    if (first.size() == 1) {
      store_.insert(digest_, {first.natural(0, 0), first.natural(0, 1)});
      return ok_status();
    }
  }
  return unavailable("asset {} was deleted while it was uploaded again: upload it once more", digest_.hex());
}

// ---- reading ----

Result<std::unique_ptr<AssetStore::Reader>> PostgresAssets::open_asset(const Sha256& digest) const {
  LM_ASSIGN_OR_RETURN(const Entry entry, find(digest));
  return std::unique_ptr<Reader>(std::make_unique<PostgresReader>(pool_, digest, entry));
}

Result<std::string> PostgresReader::next(std::size_t limit_bytes) {
  std::string bytes;
  while (bytes.size() < limit_bytes) {
    if (given_bytes_ == piece_.size()) {
      if (fetched_bytes_ == entry_.size_bytes) {
        break;
      }
      LM_ASSIGN_OR_RETURN(const Rows rows,
                          Borrowed(pool_).query("SELECT bytes FROM asset_pieces WHERE asset = $1 AND position = $2",
                                                Parameters(entry_.id, next_position_)));
      if (rows.size() == 0 || rows.view(0, 0).empty()) {
        return data_loss("asset {} ends after {} of {} bytes in the database", digest_.hex(), fetched_bytes_,
                         entry_.size_bytes);
      }
      piece_ = rows.text(0, 0);
      given_bytes_ = 0;
      fetched_bytes_ += piece_.size();
      ++next_position_;
    }
    const std::string_view more = std::string_view(piece_).substr(given_bytes_, limit_bytes - bytes.size());
    bytes += more;
    given_bytes_ += more.size();
  }
  return bytes;
}

// ---- deleting ----

std::uint64_t PostgresAssets::collect(const std::set<Sha256>& wanted, std::int64_t spare_age_seconds) {
  Borrowed session(pool_);
  const Result<Rows> old = session.query(
      "SELECT digest FROM assets WHERE digest IS NOT NULL AND stored <= clock_timestamp() - make_interval(secs => $1)",
      Parameters(static_cast<double>(spare_age_seconds)));
  std::uint64_t freed_bytes = 0;
  for (int row = 0; old.ok() && row < old->size(); ++row) {
    const Result<Sha256> digest = digest_from_bytes(old->view(row, 0));
    const Result<Entry> entry = digest.ok() ? find(*digest) : digest.status();
    if (!entry.ok() || wanted.contains(*digest)) {
      continue;
    }
    Status failure;
    const bool removed = remove_unless_kept(*digest, spare_age_seconds, [&] {
      failure = remove(session, entry->id);
      if (failure.ok()) {
        erase(*digest, *entry);
      }
      return failure.ok();
    });
    if (!failure.ok()) {
      spdlog::warn("cannot delete assets: {}", message_of(failure));
      break;
    }
    if (removed) {
      freed_bytes += entry->size_bytes;
      budget_.removed(*digest, entry->size_bytes);
    }
  }
  return freed_bytes;
}

void PostgresAssets::forget(const Reader& damaged) {
  const auto& read = static_cast<const PostgresReader&>(damaged);
  Borrowed session(pool_);
  if (const Status status = remove(session, read.entry().id); !status.ok()) {
    spdlog::warn("cannot delete asset {}: {}", read.digest().hex(), message_of(status));
    return;
  }
  if (erase(read.digest(), read.entry())) {
    budget_.removed(read.digest(), read.entry().size_bytes);
  }
}

}  // namespace

Result<std::unique_ptr<AssetStore>> open_postgres_assets(std::shared_ptr<Leadership> leadership, AssetLimits limits) {
  Session session(leadership->target(), {}, kAssetCallTimeout);
  LM_RETURN_IF_ERROR(
      session
          .query("WITH own AS MATERIALIZED (SELECT fence($1)) DELETE FROM assets USING own WHERE digest IS NULL",
                 Parameters(leadership->epoch()))
          .status());
  LM_ASSIGN_OR_RETURN(const Rows rows,
                      session.query("SELECT digest, id, size_bytes FROM assets WHERE digest IS NOT NULL"));
  std::map<Sha256, Entry> entries;
  std::uint64_t total_bytes = 0;
  for (int row = 0; row < rows.size(); ++row) {
    const Result<Sha256> digest = digest_from_bytes(rows.view(row, 0));
    if (!digest.ok()) {
      return data_loss("{}: the digest of an asset has {} bytes, not 32", session.place(), rows.view(row, 0).size());
    }
    entries.emplace(*digest, Entry{rows.natural(row, 1), rows.natural(row, 2)});
    total_bytes += rows.natural(row, 2);
  }
  return std::unique_ptr<AssetStore>(
      std::make_unique<PostgresAssets>(std::move(leadership), limits, std::move(entries), total_bytes));
}

}  // namespace lightmill::postgres

// Newest values by key, with a log of changes. Viewers get only differences.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace lightmill {

/// Bytes that many viewers share.
using SharedBytes = std::shared_ptr<const std::string>;

/// Position of a reader in the log.
struct ChangeCursor {
  bool begun = false;       ///< otherwise it knows nothing, and receives even an empty log
  std::uint64_t seen = 0;   ///< a stamp
  std::uint64_t floor = 0;  ///< removals up to this stamp do not concern it, because it began later
};

/// Every change gets the next stamp. A key that changes again moves to the end. So slow readers get each key once, with
/// its newest value. Not thread-safe.
template <class Key>
class ChangeLog {
 public:
  struct Entry {
    SharedBytes bytes;  ///< null: removed
    std::string owner;
  };
  struct Changes {
    bool whole = false;  ///< the reader has to drop what it has
    bool more = false;   ///< more entries follow
    std::vector<std::pair<Key, const Entry*>> entries;
  };

  /// Number of removed keys that are kept. Readers that have missed more start again.
  explicit ChangeLog(std::size_t removals_kept = 1'000) : removals_kept_(removals_kept) {}

  /// Equal bytes are no change.
  void put(const Key& key, std::string bytes, std::string owner = {}) {
    if (const auto at = entries_.find(key);
        at != entries_.end() && at->second.entry.bytes != nullptr && *at->second.entry.bytes == bytes) {
      return;
    }
    set(key, {std::make_shared<const std::string>(std::move(bytes)), std::move(owner)});
  }
  void remove(const Key& key) {
    const auto at = entries_.find(key);
    if (at == entries_.end() || at->second.entry.bytes == nullptr) {
      return;
    }
    set(key, {nullptr, at->second.entry.owner});
    removed_.emplace(stamp_, key);
    while (removed_.size() > removals_kept_) {
      forgotten_ = removed_.begin()->first;
      order_.erase(forgotten_);
      entries_.erase(removed_.begin()->second);
      removed_.erase(removed_.begin());
    }
  }

  bool has_changes_for(const ChangeCursor& reader) const { return !reader.begun || reader.seen < stamp_; }
  /// The next `most` changes for the reader at most, oldest first. Moves the reader behind them. The entries are valid
  /// until the next change.
  Changes since(ChangeCursor& reader, std::size_t most) const {
    Changes changes;
    if (!reader.begun || (forgotten_ > reader.floor && reader.seen < forgotten_)) {
      changes.whole = true;
      reader = {true, 0, forgotten_};
    }
    for (auto at = order_.upper_bound(reader.seen); at != order_.end(); ++at) {
      if (changes.entries.size() == most) {
        changes.more = true;
        return changes;
      }
      reader.seen = at->first;
      const Entry& entry = entries_.at(at->second).entry;
      if (entry.bytes != nullptr || !changes.whole) {
        changes.entries.emplace_back(at->second, &entry);
      }
    }
    reader.seen = stamp_;
    return changes;
  }
  /// Keys that are not removed.
  std::vector<Key> keys() const {
    std::vector<Key> keys;
    for (const auto& [key, at] : entries_) {
      if (at.entry.bytes != nullptr) {
        keys.push_back(key);
      }
    }
    return keys;
  }
  bool has(const Key& key) const { return entries_.contains(key); }  ///< perhaps removed
  std::size_t size() const { return entries_.size() - removed_.size(); }

 private:
  struct Stamped {
    Entry entry;
    std::uint64_t stamp = 0;
  };
  void set(const Key& key, Entry entry) {
    Stamped& at = entries_[key];
    order_.erase(at.stamp);
    removed_.erase(at.stamp);
    at = {std::move(entry), ++stamp_};
    order_.emplace(stamp_, key);
  }

  std::size_t removals_kept_;
  std::map<Key, Stamped> entries_;
  std::map<std::uint64_t, Key> order_, removed_;  ///< by stamp
  std::uint64_t stamp_ = 0, forgotten_ = 0;
};

}  // namespace lightmill

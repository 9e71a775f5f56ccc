// The newest values by their keys, and which of them changed since somebody looked: what viewers get are differences.
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

/// Up to where a reader knows everything.
struct ChangeCursor {
  bool begun = false;       ///< else it knows nothing, and has to be told even of an empty log
  std::uint64_t seen = 0;   ///< a stamp
  std::uint64_t floor = 0;  ///< removals up to here do not concern it: it began after them
};

/// Every change gets the next stamp. What changes again moves to the end, so that readers who come seldom get each key
/// once, with its newest value. Not thread-safe.
template <class Key>
class ChangeLog {
 public:
  struct Entry {
    SharedBytes bytes;  ///< null: removed
    std::string owner;
  };
  struct Changes {
    bool whole = false;  ///< what the reader has is to be forgotten first
    bool more = false;   ///< there are more than were asked for
    std::vector<std::pair<Key, const Entry*>> entries;
  };

  /// So many removed keys are remembered; readers who have missed more begin again.
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

  bool news_for(const ChangeCursor& reader) const { return !reader.begun || reader.seen < stamp_; }
  /// What the reader does not know yet, oldest first and at most so many; it knows them then. The entries are valid
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
  /// Of what is not removed.
  std::vector<Key> keys() const {
    std::vector<Key> keys;
    for (const auto& [key, at] : entries_) {
      if (at.entry.bytes != nullptr) {
        keys.push_back(key);
      }
    }
    return keys;
  }
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

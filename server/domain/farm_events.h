// Recent events of the farm. Only in memory; the coordinator's log has the same.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "server/domain/effects.h"

namespace lightmill {

struct RecordedEvent {
  std::uint64_t number = 0;  ///< counts up from 1 since the coordinator began
  std::int64_t unix_ms = 0;
  Note note;
  std::string owner;  ///< of its job; empty if unknown
};

/// The last 5,000 events, a few MB. Not thread-safe.
class FarmEvents {
 public:
  static constexpr std::size_t kMax = 5'000, kMaxTextBytes = 1'000;

  enum class Kind { all, warnings, jobs, workers };  ///< the last two: events of any job, or of any worker
  /// By default, all events.
  struct Filter {
    Kind kind = Kind::all;
    JobId job{};
    std::string worker;
    std::uint64_t before = 0;  ///< only lower numbers; 0: from the newest
    /// For events about a job. Null admits all.
    std::function<bool(const std::string& owner)> admits;
  };
  struct Page {
    std::vector<RecordedEvent> events;
    std::uint64_t next = 0;  ///< Filter::before of the next page; 0: no next page
  };

  /// Cuts the note's text, and makes it printable.
  void add(std::int64_t unix_ms, Note note, std::string owner);
  /// Newest first, at most `most` (at least 1).
  Page find(const Filter& filter, std::size_t most) const;

 private:
  std::deque<RecordedEvent> events_;  ///< oldest first
  std::uint64_t next_ = 1;
};

}  // namespace lightmill

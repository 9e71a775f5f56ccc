// What the coordinator has said of what happened, the newest first. In memory alone; its log has the same.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <string>
#include <vector>

#include "server/domain/effects.h"

namespace lightmill {

struct FarmEvent {
  std::uint64_t number = 0;  ///< counts up from 1 since the coordinator began
  std::int64_t unix_ms = 0;
  Note note;
  std::string owner;  ///< of the job that it is about; empty if that is not known
};

/// The last 5,000; some MB. Not thread-safe.
class FarmEvents {
 public:
  static constexpr std::size_t kMost = 5'000, kMostTextBytes = 1'000;

  enum class Kind { all, warnings, jobs, workers };  ///< the last two: what is about a job, or a worker
  /// What is asked for; all by default.
  struct Filter {
    Kind kind = Kind::all;
    JobId job{};
    std::string worker;
    std::uint64_t before = 0;  ///< numbers below; 0: from the newest
    /// Null: all. Of events about a job.
    std::function<bool(const std::string& owner)> admits;
  };
  struct Page {
    std::vector<FarmEvent> events;
    std::uint64_t next = 0;  ///< Filter::before of the next page; 0: there is none
  };

  /// Texts from elsewhere are cut and made printable.
  void add(std::int64_t unix_ms, Note note, std::string owner);
  /// Newest first, at most `most` (at least 1).
  Page find(const Filter& filter, std::size_t most) const;

 private:
  std::deque<FarmEvent> events_;  ///< oldest first
  std::uint64_t next_ = 1;
};

}  // namespace lightmill

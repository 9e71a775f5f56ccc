#include "server/store/check_state.h"

#include <algorithm>
#include <map>
#include <set>
#include <span>

#include "common/base/log.h"
#include "common/base/number_text.h"
#include "server/store/check_rows.h"
#include "server/store/load_state.h"

namespace lightmill {
namespace {

constexpr std::size_t kPieceBytes = std::size_t{1} << 20;

/// Whether a job in this state has its lost nodes rendered again.
bool renders_lost_nodes(JobState state) {
  return state != JobState::failed && state != JobState::cancelled;
}

/// "job 1", "jobs 1, 2, 3 and 5 more".
std::string named(std::span<const JobId> jobs) {
  constexpr std::size_t kNamed = 3;
  std::vector<std::uint64_t> numbers;
  for (const JobId job : jobs.first(std::min(jobs.size(), kNamed))) {
    numbers.push_back(job.value);
  }
  const std::string others = jobs.size() > kNamed ? fmt::format(" and {} more", jobs.size() - kNamed) : "";
  return fmt::format("{} {}{}", jobs.size() == 1 ? "job" : "jobs", fmt::join(numbers, ", "), others);
}

/// Reads the films of ended jobs. load() does not read their pixels.
Status check_films(Store& store, StoredState& state, std::vector<StoreOp>& repairs) {
  const auto read = [&](JobId job, const FilmPosition& after) -> Result<FilmPiece> {
    LM_ASSIGN_OR_RETURN(FilmPiece piece, store.read_film(job, after));
    for (StoredState::StoredNode& node : piece.nodes) {
      node.node.reset();
    }
    return piece;
  };
  for (StoredState::StoredJob& job : state.jobs) {
    if (has_ended(job.record.state)) {
      LM_RETURN_IF_ERROR(stored::load_values(read, job, state, repairs));
    }
  }
  return ok_status();
}

/// Reports damaged jobs, and removes them.
Status report_jobs(const StoredState& state, Store& store, StateCheck& check) {
  std::vector<StoreOp> deletes;
  for (const JobId job : state.damaged_jobs) {
    check.report.push_back(fmt::format(
        "job {}: its stored data is damaged, so the job is removed. Submit it again, or restore a backup of this farm",
        job.value));
    deletes.push_back(DeleteJobRows{job});
  }
  check.sound = check.sound && deletes.empty();
  check.whole = check.whole && deletes.empty();
  return deletes.empty() ? ok_status() : store.commit(deletes);
}

void report_nodes(const StoredState& state, StateCheck& check) {
  std::map<JobId, std::uint64_t> damaged;
  for (const NodeKey& key : state.damaged) {
    ++damaged[key.job];
  }
  for (const StoredState::StoredJob& job : state.jobs) {
    if (const auto found = damaged.find(job.record.id); found != damaged.end()) {
      check.report.push_back(fmt::format("job {}: {} of its nodes {} damaged and removed: {}", job.record.id.value,
                                         found->second, found->second == 1 ? "was" : "were",
                                         renders_lost_nodes(job.record.state)
                                             ? "their samples are rendered again when a coordinator starts"
                                             : "its picture lacks them"));
      check.whole = check.whole && renders_lost_nodes(job.record.state);
    }
  }
  check.report.insert(check.report.end(), state.damaged_entries.begin(), state.damaged_entries.end());
  check.whole = check.whole && state.damaged_entries.empty();
  check.sound = check.sound && state.damaged.empty() && state.damaged_results.empty() && state.damaged_entries.empty();
}

std::string blocked_text(std::span<const JobId> jobs) {
  return fmt::format("It blocks the samples that {} {} not rendered yet. Submit a job with the same file", named(jobs),
                     jobs.size() == 1 ? "has" : "have");
}

std::string ended_text(std::span<const JobId> jobs) {
  return jobs.size() == 1
             ? fmt::format("No running job needs it: {} has ended, and needs it only for `lightmill extend`",
                           named(jobs))
             : fmt::format("No running job needs it: {} have ended, and need it only for `lightmill extend`",
                           named(jobs));
}

void report_assets(const StoredState& state, const AssetStore& assets, const AssetCheck& found, StateCheck& check) {
  const std::set<Sha256> damaged(found.damaged.begin(), found.damaged.end());
  check.sound = check.sound && damaged.empty();
  for (const Sha256& digest : damaged) {
    check.report.push_back(fmt::format("asset {}: damaged and deleted", digest.hex()));
  }
  std::set<JobId> incomplete;  // ended jobs that render lost samples again
  for (const NodeKey& key : state.damaged) {
    incomplete.insert(key.job);
  }
  struct Users {
    std::vector<JobId> blocked, ended;
  };
  std::map<Sha256, Users> missing;
  for (const StoredState::StoredJob& job : state.jobs) {
    const bool renders =
        !has_ended(job.record.state) || (renders_lost_nodes(job.record.state) && incomplete.contains(job.record.id));
    for (const Sha256& digest : *job.record.spec.settings.assets) {
      if (!assets.has(digest)) {
        (renders ? missing[digest].blocked : missing[digest].ended).push_back(job.record.id);
      }
    }
  }
  for (const auto& [digest, users] : missing) {
    const bool blocks = !users.blocked.empty();
    check.report.push_back(fmt::format("asset {} is missing. {}", digest.hex(),
                                       blocks ? blocked_text(users.blocked) : ended_text(users.ended)));
    check.whole = check.whole && !blocks;
  }
  check.missing_assets = missing.size();
}

/// Like check_asset(), and deletes nothing.
Result<std::uint64_t> read_through(AssetStore::Reader& reader, const Sha256& digest) {
  Sha256Hasher hasher;
  std::uint64_t size_bytes = 0;
  for (;;) {
    LM_ASSIGN_OR_RETURN(const std::string piece, reader.next(kPieceBytes));
    if (piece.empty()) {
      break;
    }
    hasher.append(as_byte_view(piece));
    size_bytes += piece.size();
  }
  if (const Sha256 actual = hasher.finish(); actual != digest) {
    return data_loss("its {} bytes have the digest {}", size_bytes, actual.hex());
  }
  return size_bytes;
}

}  // namespace

Result<std::uint64_t> check_asset(AssetStore& store, const Sha256& digest) {
  LM_ASSIGN_OR_RETURN(std::unique_ptr<AssetStore::Reader> reader, store.open_asset(digest));
  Result<std::uint64_t> size_bytes = read_through(*reader, digest);
  if (size_bytes.status().code() == StatusCode::kDataLoss) {
    spdlog::warn("asset {} is damaged and was deleted: {}", digest.hex(), message_of(size_bytes.status()));
    store.forget(*reader);
  }
  return size_bytes;
}

Result<AssetCheck> check_assets(AssetStore& store) {
  AssetCheck check;
  for (const Sha256& digest : store.digests()) {
    if (const Result<std::uint64_t> size_bytes = check_asset(store, digest); size_bytes.ok()) {
      ++check.assets;
      check.bytes += *size_bytes;
    } else if (size_bytes.status().code() != StatusCode::kDataLoss) {
      return with_context(size_bytes.status(), fmt::format("asset {}", digest.hex()));
    } else {
      check.damaged.push_back(digest);
    }
  }
  return check;
}

std::string conclusion_of(const StateCheck& check) {
  if (!check.whole) {
    return "";
  }
  std::string text = !check.sound               ? "damaged data is rendered or sent again"
                     : check.missing_assets > 0 ? "nothing is lost that a running job needs"
                                                : "all is sound";
  if (check.missing_assets > 0) {
    text += fmt::format(". {} {} missing", counted(check.missing_assets, "asset"),
                        check.missing_assets == 1 ? "is" : "are");
  }
  return text;
}

Result<StateCheck> check_state(Store& store, AssetStore& assets) {
  LM_RETURN_IF_ERROR(store.check_structure());
  LM_ASSIGN_OR_RETURN(StoredState state, store.load());
  std::vector<StoreOp> repairs;
  LM_RETURN_IF_ERROR(remove_invalid_rows(state, repairs));
  LM_RETURN_IF_ERROR(check_films(store, state, repairs));
  report_lost_nodes(state);
  for (const NodeKey& key : state.damaged) {
    repairs.push_back(DropResults{key});
  }
  if (!repairs.empty()) {
    LM_RETURN_IF_ERROR(store.commit(repairs));
  }
  LM_ASSIGN_OR_RETURN(const AssetCheck found, check_assets(assets));
  std::uint64_t nodes = 0, bytes = 0;
  for (const StoredState::StoredJob& job : state.jobs) {
    nodes += job.nodes.size();
    for (const StoredState::StoredNode& stored : job.nodes) {
      bytes += stored.outline.values * sizeof(float);
    }
  }
  StateCheck check;
  check.report.push_back(fmt::format("{} with {} of {} and {} of {} have correct checksums",
                                     counted(state.jobs.size(), "job"), counted(nodes, "node"), human_bytes(bytes),
                                     counted(found.assets, "asset"), human_bytes(found.bytes)));
  LM_RETURN_IF_ERROR(report_jobs(state, store, check));
  report_nodes(state, check);
  report_assets(state, assets, found, check);
  return check;
}

}  // namespace lightmill

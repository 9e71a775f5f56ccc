#include "tests/simulation/damages.h"

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "common/base/check.h"
#include "tests/simulation/effects_text.h"
#include "tests/simulation/fake_renderer.h"
#include "tests/simulation/row_damage.h"
#include "tests/simulation/stored_farm.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kDamagesPerFarm = 16;

using Files = std::map<fs::path, std::string>;  ///< bytes by path in the folder

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "lightmill-damage-XXXXXX").string();
    LM_CHECK(::mkdtemp(name.data()) != nullptr);
    path_ = name;
  }
  explicit Folder(const Files& files) : Folder() {
    for (const auto& [file, bytes] : files) {
      fs::create_directories((path_ / file).parent_path());
      std::ofstream(path_ / file, std::ios::binary) << bytes;
    }
  }
  ~Folder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  const fs::path& path() const { return path_; }
  Files files() const {
    Files files;
    for (const auto& entry : fs::recursive_directory_iterator(path_)) {
      if (entry.is_regular_file()) {
        std::ifstream in(entry.path(), std::ios::binary);
        files[fs::relative(entry.path(), path_)] = {std::istreambuf_iterator<char>(in), {}};
      }
    }
    return files;
  }

 private:
  fs::path path_;
};

const fs::path kDatabase = "lightmill.sqlite", kJournal = "lightmill.sqlite-wal", kChain = "lightmill.sqlite-chain";

/// A killed farm, and its outcome without damage.
struct KilledFarm {
  std::map<Sha256, std::string> assets;
  std::map<JobId, StoredJob> jobs;
  bool closed = false;       ///< its coordinator stopped normally: the database has everything
  Files before_last, files;  ///< the last commit adds one token
  StoredState loaded;
  std::uint64_t rendered = 0;  ///< results until all jobs are done
};

constexpr const char* kLastToken = "last";

TokenRecord token_of(const std::string& id) {
  TokenRecord token;
  token.id = id;
  token.name = "somebody";
  token.roles.add(Role::view);
  return token;
}

KilledFarm kill_farm(std::uint64_t seed) {
  Random random(seed);
  KilledFarm killed;
  for (std::uint64_t i = 0; i < 3; ++i) {
    std::string bytes(1 + random.below(3000), '\0');
    std::ranges::generate(bytes, [&] { return static_cast<char>(random.next()); });
    killed.assets[sha256(bytes)] = std::move(bytes);
  }
  const Folder folder;
  std::uint64_t number = 0;
  for (const bool last : {false, true}) {  // the first half goes into the database, the second into the journal
    auto farm = std::move(*StoredFarm::start(folder.path(), false, killed.assets));
    farm->send_assets();
    for (std::uint64_t jobs = 1 + random.below(2); jobs > 0; --jobs) {
      StoredJob job = draw_job(++number, killed.assets, random);
      killed.jobs[farm->submit(job)] = job;
      farm->work(random.below(40));
    }
    farm->commit({PutQuarantine{{{fmt::format("liar-{}", number), "machine"}, "it lied", 5}},
                  PutToken{token_of(fmt::format("token-{}", number))}});
    if (last) {
      killed.before_last = folder.files();
      farm->commit({PutToken{token_of(kLastToken)}});
      if (killed.closed = random.chance(0.5); killed.closed) {
        farm.reset();
      }
      killed.files = folder.files();
    }
  }
  const Folder again(killed.files);
  auto farm = std::move(*StoredFarm::start(again.path(), false, killed.assets));
  killed.loaded = farm->loaded();
  const std::string wrong = farm->finish();
  LM_CHECK(wrong.empty(), "seed {}: {}", seed, wrong);
  killed.rendered = farm->rendered();
  return killed;
}

// ---- damage ----

std::string name_of(const fs::path& file) {
  return file == kDatabase ? "database" : file == kJournal ? "journal" : file == kChain ? "chain" : "asset";
}

/// Damages one file as disks do. Returns the kind.
std::string damage_file(Files& files, Random& random) {
  std::map<std::string, std::vector<fs::path>> by_kind;
  for (const auto& [file, bytes] : files) {
    by_kind[name_of(file)].push_back(file);
  }
  const auto& [kind, of_kind] = *std::next(by_kind.begin(), static_cast<std::ptrdiff_t>(random.below(by_kind.size())));
  const auto at = files.find(of_kind[random.below(of_kind.size())]);
  std::string& bytes = at->second;
  const std::size_t place = random.below(bytes.size()), sector = place / 512 * 512,
                    end = std::min(sector + 512, bytes.size());
  switch (random.below(5)) {
    case 0:
      bytes[place] ^= static_cast<char>(1 << random.below(8));
      return kind + ": a flipped bit";
    case 1:
      std::fill(bytes.begin() + static_cast<std::ptrdiff_t>(sector), bytes.begin() + static_cast<std::ptrdiff_t>(end),
                '\0');
      return kind + ": a sector of zeros";
    case 2:
      std::generate(bytes.begin() + static_cast<std::ptrdiff_t>(sector),
                    bytes.begin() + static_cast<std::ptrdiff_t>(end), [&] { return static_cast<char>(random.next()); });
      return kind + ": a sector of noise";
    case 3:
      bytes.resize(place);
      return kind + ": its end is gone";
    default:
      files.erase(at);
      return kind + ": the file is gone";
  }
}

/// The journal loses commits, or part of one.
std::string lose_commits(const KilledFarm& killed, Files& files, Random& random) {
  const std::size_t before = killed.before_last.at(kJournal).size();
  if (random.chance(0.5)) {
    files[kJournal].resize(random.below(before));
    return "journal: acknowledged commits are gone";
  }
  files[kChain] = killed.before_last.at(kChain);
  files[kJournal].resize(before + random.below(files[kJournal].size() - before));
  return "journal: a commit that was not acknowledged is gone";
}

// ---- what must hold ----

std::string row_text(const JobRecord& record) {
  Effects effects;
  effects.writes.push_back(PutJob{record});
  return effects_text(effects);
}

/// A silent loss or change of the state; empty if there is none.
std::string silent_losses(const KilledFarm& killed, const StoredState& now, bool may_lack_last) {
  const StoredState& before = killed.loaded;
  if (now.secret != before.secret || now.epoch < before.epoch || now.next_job_id < before.next_job_id) {
    return "another secret, epoch or next job id";
  }
  for (const StoredState::StoredJob& job : before.jobs) {
    const auto found = std::ranges::find(now.jobs, job.record.id, [](const auto& each) { return each.record.id; });
    if (std::ranges::count(now.damaged_jobs, job.record.id) > 0) {
      continue;
    }
    if (found == now.jobs.end()) {
      return fmt::format("job {} is gone", job.record.id.value);
    }
    if (row_text(found->record) != row_text(job.record) && now.damaged_entries.empty()) {
      return fmt::format("job {} has changed:\n{}instead of\n{}", job.record.id.value, row_text(found->record),
                         row_text(job.record));
    }
    for (const StoredState::StoredResult& result : job.results) {
      const bool same = std::ranges::any_of(found->results, [&](const StoredState::StoredResult& each) {
        return each.tile == result.tile && each.range == result.range && each.hash == result.hash &&
               now.renderers.at(each.by) == before.renderers.at(result.by) &&
               each.audit_pending == result.audit_pending;
      });
      const bool named =
          std::ranges::any_of(
              now.damaged, [&](const NodeKey& key) { return key.job == job.record.id && key.tile == result.tile; }) ||
          std::ranges::any_of(now.damaged_results, [&](const DropResultRow& row) { return row.job == job.record.id; });
      if (!same && !named) {
        return fmt::format("job {}: a result of tile {} has changed or is gone", job.record.id.value,
                           result.tile.value);
      }
    }
  }
  if (!now.damaged_entries.empty()) {
    return "";
  }
  for (const QuarantineRecord& record : before.quarantine) {
    if (std::ranges::count(now.quarantine, record) == 0) {
      return "a quarantine is gone";
    }
  }
  for (const TokenRecord& token : before.tokens) {
    const bool there = std::ranges::any_of(now.tokens, [&](const TokenRecord& each) {
      return each.id == token.id && each.name == token.name && each.roles == token.roles;
    });
    if (!there && !(may_lack_last && token.id == kLastToken)) {
      return fmt::format("token {} is gone", token.id);
    }
  }
  return "";
}

/// Starts on the files, finishes the jobs, and checks the outcome.
void run_on(const KilledFarm& killed, const Files& files, bool may_lack_last, DamageReport& report) {
  const Folder folder(files);
  bool accept_loss = false;
  auto farm = StoredFarm::start(folder.path(), accept_loss, killed.assets);
  if (!farm.ok()) {
    report.outcome = "refused";
    if (message_of(farm.status()).empty()) {
      report.failure = "the store is refused without a reason";
    }
    Files left = folder.files();
    for (const fs::path& file : {kDatabase, kJournal}) {
      const auto was = files.find(file);
      if (was != files.end() && left[file] != was->second) {
        report.failure = fmt::format("the {} of a refused store has changed", name_of(file));
      }
    }
    accept_loss = true;
    farm = StoredFarm::start(folder.path(), accept_loss, killed.assets);
    if (!farm.ok()) {
      return;
    }
  }
  const StoredState& loaded = (*farm)->loaded();
  if (!accept_loss && report.failure.empty()) {
    report.failure = silent_losses(killed, loaded, may_lack_last);
  }
  std::string wrong = (*farm)->finish();
  wrong = wrong.empty() ? (*farm)->wrong_films(killed.jobs) : wrong;
  report.failure = report.failure.empty() ? wrong : report.failure;
  (*farm)->fetch_assets();
  if (accept_loss) {
    return;
  }
  const bool again = !loaded.damaged.empty() || !loaded.damaged_results.empty() || (*farm)->found_damage_later();
  report.outcome = !loaded.damaged_jobs.empty() || !loaded.damaged_entries.empty() ? "named"
                   : (*farm)->sent_again() > 0                                     ? "sent again"
                   : again                                                         ? "rendered again"
                                                                                   : "same bits";
  if (report.outcome == std::string("same bits") && (*farm)->rendered() > killed.rendered && report.failure.empty()) {
    report.failure = "samples are rendered again, but no damage was reported";
  }
}

}  // namespace

DamageReport damage_one(std::uint64_t seed, bool forge) {
  static thread_local std::pair<std::uint64_t, KilledFarm> known{~std::uint64_t{0}, {}};
  const std::uint64_t of_farm = seed / kDamagesPerFarm;
  if (known.first != of_farm) {
    shared_renderer().trim();
    known = {of_farm, kill_farm(of_farm)};
  }
  const KilledFarm& killed = known.second;
  Random random(~seed);
  Files files = killed.files;
  DamageReport report;
  if (const std::uint64_t kind = random.below(10); kind < 5 && !forge) {
    report.kind = damage_file(files, random);
  } else if (kind < 6 && !forge && !killed.closed) {
    report.kind = lose_commits(killed, files, random);
  } else {
    const Folder folder(files);
    const fs::path database = StoredFarm::database_of(folder.path());
    report.kind = forge      ? fmt::format("{}: forged", forge_node(database, random) ? "nodes" : "no node")
                  : kind < 8 ? fmt::format("row of {}: a flipped bit", flip_bit_in_row(database, random))
                             : fmt::format("row of {}: it is gone", lose_row(database, random));
    files = folder.files();
  }
  run_on(killed, files, report.kind == "journal: a commit that was not acknowledged is gone", report);
  return report;
}

std::string DamageTable::text() const {
  std::string text = fmt::format("{:55}", "damage");
  for (const char* outcome : kDamageOutcomes) {
    text += fmt::format(" {:>14}", outcome);
  }
  text += '\n';
  for (const auto& [kind, outcomes] : counts_) {
    text += fmt::format("{:55}", kind);
    for (const char* outcome : kDamageOutcomes) {
      const auto found = outcomes.find(outcome);
      text += fmt::format(" {:>14}", found == outcomes.end() ? 0 : found->second);
    }
    text += '\n';
  }
  return text;
}

}  // namespace lightmill::simulation

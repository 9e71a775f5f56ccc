#include "tests/simulation/loss_checks.h"

#include <algorithm>

#include "server/domain/limits.h"
#include "tests/simulation/server_side.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {
namespace {

/// The right limits, even if a bug is planted into those of the farm.
const CoordinatorLimits kRule;

/// Part of the note that a job no longer goes to the workers of one identity. Their losses follow it.
constexpr std::string_view kLeft = " goes to workers of other identities: ";

bool is_loss(const Note& note) {
  return note.text.find(" lost lease ") != std::string::npos;
}

/// "5 workers were lost in a row, the last ones (a, b, c) while they had nothing to do but ...".
struct Accusation {
  std::uint64_t lost = 0;
  std::vector<std::string> alone;

  explicit Accusation(const std::string& reason) : lost(std::strtoull(reason.c_str(), nullptr, 10)) {
    std::size_t at = reason.find('(') + 1;
    for (const std::size_t end = reason.find(')'); at < end;) {
      const std::size_t next = std::min(reason.find(", ", at), end);
      alone.push_back(reason.substr(at, next - at));
      at = next + 2;
    }
    std::ranges::sort(alone);
  }
};

}  // namespace

void LossChecks::server_starts() {
  lent_.clear();
  rows_.clear();
  left_.clear();
  lives_.clear();
}

void LossChecks::hello_came(const std::shared_ptr<Stream>& stream, const WorkerHello& hello) {
  const auto [known, is_new] = lives_.try_emplace(stream->name, stream->worker_life);
  comes_ = stream->name;
  comes_again_ = !is_new && std::exchange(known->second, stream->worker_life) == stream->worker_life;
  for (const HeldLease& held : hello.held) {
    Lent& lent = lent_[held.lease];
    lent.job = held.unit.job;
    lent.range = held.unit.range;
    lent.tiles = held.unit.tiles;
    if (lent.stream == nullptr || std::exchange(lent.lost, false)) {
      lent.since = stream->session;
      lent.alone = false;
    }
    lent.stream = stream;
    lent.left = world_.now;
  }
}

void LossChecks::sent(const std::shared_ptr<Stream>& stream, const Outgoing& message) {
  for (const LeaseId lease : leases_granted(std::span(&message, 1))) {
    lent_[lease].stream = stream;
    lent_[lease].left = world_.now;
  }
}

void LossChecks::check(const Effects& effects) {
  note_results(effects);
  for (const Note& note : effects.notes) {
    if (is_loss(note)) {
      count_loss(note);
    } else if (note.text.find(kLeft) != std::string::npos) {
      check_left(note);
    }
  }
  for (const StoreOp& op : effects.writes) {
    if (const auto* const put = std::get_if<PutJob>(&op); put != nullptr && has_ended(put->record.state)) {
      if (put->record.reason.find(kLostInARow) != std::string::npos) {
        check_failed(put->record);
      }
      std::erase_if(rows_, [&](const auto& row) { return row.first.first == put->record.id; });
    }
  }
  note_grants(effects);
}

void LossChecks::note_results(const Effects& effects) {
  for (const StoreOp& op : effects.writes) {
    if (const auto* const result = std::get_if<PutResult>(&op)) {
      rows_.erase({result->key.job, result->key.tile});
    } else if (const auto* const put = std::get_if<PutJob>(&op);
               put != nullptr && put->record.method_notes.candidates.empty()) {
      rows_.erase({put->record.id, std::nullopt});
    }
  }
}

bool LossChecks::is_undisturbed(const Lent& lent) const {
  const SimulatedWorker& worker = workers_[lent.stream->worker];
  return !lent.stream->broken && worker.alive && worker.life == lent.stream->worker_life &&
         worker.disturbed < lent.left && worker.lies == Lies::never;
}

void LossChecks::check_sent(const Effects& effects) {
  for (const Note& note : effects.notes) {
    if (!is_loss(note)) {
      continue;
    }
    if (const Lent& lent = lent_[note.lease]; lent.stream == nullptr) {
      world_.fail(fmt::format("{}, but the lease was not sent", note.text));
    } else if (is_undisturbed(lent) && note.worker != comes_) {  // a hello may come after the one of a later stream
      world_.fail(fmt::format("{}, but the worker had no fault since it got the lease", note.text));
    }
  }
  comes_.clear();
}

void LossChecks::count_loss(const Note& note) {
  Lent& lent = lent_[note.lease];
  lent.lost = true;
  const FilmOutline* const film = server_.coordinator()->outline(lent.job);
  if ((comes_again_ && note.worker == comes_) || lent.audits || film == nullptr) {
    return;  // the process is fine, its work was rendered before, or the work is no longer wanted
  }
  const auto count = [&](const std::optional<TileId>& tile) {
    Row& row = rows_[{lent.job, tile}];
    if (const std::pair worker(note.worker, lent.since); std::exchange(row.last, worker) != worker) {
      ++row.lost;
      if (lent.alone) {
        row.alone.push_back(note.worker);
      }
    }
  };
  if (lent.tiles.empty()) {
    count(std::nullopt);
  }
  for (const TileId tile : lent.tiles) {
    if (!film->covered(tile, lent.range)) {
      count(tile);
    }
  }
}

void LossChecks::note_grants(const Effects& effects) {
  for (const std::vector<Outgoing>* channel : {&effects.now, &effects.after_commit}) {
    for (const Outgoing& message : *channel) {
      if (const auto* const grant = std::get_if<LeaseGrant>(&message.message)) {
        Lent& lent = lent_[grant->lease];
        lent.job = grant->unit.job;
        lent.range = grant->unit.range;
        lent.tiles = grant->unit.tiles;
        lent.since = message.to;
        const FilmOutline* const film = server_.coordinator()->outline(lent.job);
        lent.audits = film != nullptr && film->covered(lent.tiles.front(), lent.range);
        lent.alone = lent.tiles.size() == 1 && has_one_lease(message.to);
      } else if (const auto* const pilot = std::get_if<PilotGrant>(&message.message)) {
        Lent& lent = lent_[pilot->lease];
        lent.job = pilot->job;
        lent.since = message.to;
        lent.alone = pilot_is_suspect(lent.job);
      }
    }
  }
}

bool LossChecks::has_one_lease(SessionId session) const {
  const auto stream = server_.streams().find(session);
  return stream != server_.streams().end() &&
         std::ranges::any_of(server_.coordinator()->workers(world_.now), [&](const WorkerStatus& worker) {
           return worker.name == stream->second->name && worker.leases == 1;
         });
}

bool LossChecks::pilot_is_suspect(JobId job) const {
  const auto found = rows_.find({job, std::nullopt});
  return found != rows_.end() && found->second.lost >= kRule.losses_before_alone;
}

bool LossChecks::is_true(JobId job, const std::string& reason) const {
  const Accusation said(reason);
  const TileGrid& grid = server_.coordinator()->outline(job)->grid();
  const bool true_of_some_work = std::ranges::any_of(rows_, [&](const auto& entry) {
    const auto& [of, tile] = entry.first;
    if (of != job) {
      return false;
    }
    Row row = entry.second;
    std::ranges::sort(row.alone);
    const std::string work = tile ? fmt::format("pixels at {}, {}", grid.tile_rect(*tile).x, grid.tile_rect(*tile).y)
                                  : "to try the job's methods";
    return reason.ends_with(work) && said.lost <= row.lost && std::ranges::includes(row.alone, said.alone);
  });
  return true_of_some_work && said.alone.size() >= kRule.losses_alone &&
         said.lost >= kRule.losses_before_alone + kRule.losses_alone;
}

void LossChecks::check_left(const Note& note) {
  const std::string reason = note.text.substr(note.text.find(kLeft) + kLeft.size());
  if (!is_true(note.job, reason)) {
    world_.fail(fmt::format("no such workers were lost: {}", note.text));
  }
  left_[note.job].insert(reason);
}

void LossChecks::check_failed(const JobRecord& job) {
  for (std::size_t at = 0; at < job.reason.size();) {  // the reasons of one or two identities
    const std::size_t end = std::min(job.reason.find("; ", at), job.reason.size());
    const std::string reason = job.reason.substr(at, end - at);
    at = end + 2;
    if (reason.find(kLostInARow) != std::string::npos && !left_[job.id].contains(reason) && !is_true(job.id, reason)) {
      world_.fail(fmt::format("job {} failed although no such workers were lost with it: {}", job.id.value, reason));
    }
  }
}

}  // namespace lightmill::simulation

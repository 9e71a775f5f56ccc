// The session's connection, timers and end.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/base/text.h"
#include "worker/session/session.h"

namespace lightmill {
namespace {

constexpr double kReportedCpuSeconds = 1;

}  // namespace

// ---- the stream ----

void Session::start(Time now, SessionActions& actions) {
  next_open_ = now;
  tick(now, actions);
}

void Session::connected(Time now, SessionActions& actions) {
  if (exited_) {
    return;
  }
  link_ = Link::up;
  away_deadline_.reset();
  next_heartbeat_ = now + heartbeat_interval_;
  WorkerHello hello{config_.name,
                    config_.host,
                    config_.pid,
                    config_.threads,
                    config_.fingerprint_class,
                    config_.renderer_version,
                    {},
                    draining_,
                    config_.machine,
                    true};
  for (auto& [id, lease] : leases_) {
    // Tiles that are not queued, rendering or unacknowledged are complete.
    HeldLease held{id, lease.epoch, lease.description->render_digest, {lease.unit.job, lease.unit.range, {}}, {}};
    held.unit.tiles.assign(lease.queued.begin(), lease.queued.end());
    held.unit.tiles.insert(held.unit.tiles.end(), lease.rendering.begin(), lease.rendering.end());
    held.unit.tiles.insert(held.unit.tiles.end(), lease.unacknowledged.begin(), lease.unacknowledged.end());
    std::sort(held.unit.tiles.begin(), held.unit.tiles.end());
    for (const TileId tile : held.unit.tiles) {
      held.tags.push_back(lease.tags[tile]);
    }
    if (!held.unit.tiles.empty()) {
      hello.held.push_back(std::move(held));
    }
  }
  send(std::move(hello), actions);
  longest_wait_.reset();
  for (auto& [key, result] : results_) {
    result.sent = now;
  }
  advance(actions);
}

void Session::welcome(const Welcome& welcome, Time now, SessionActions& actions) {
  welcomed_ = true;
  epoch_ = welcome.epoch;
  heartbeat_interval_ = std::max<Duration>(welcome.heartbeat_interval, std::chrono::milliseconds(1));
  next_heartbeat_ = now + heartbeat_interval_;
  if (farm_ && *farm_ != welcome.farm) {
    drop_everything("another farm answers at this address now. Results for the old farm are dropped", actions);
  } else if (!name_in_farm_.empty() && name_in_farm_ != welcome.worker) {
    drop_everything(fmt::format("this worker's name is '{}' now. It was '{}'. Results under the old name are dropped",
                                printable(welcome.worker), printable(name_in_farm_)),
                    actions);
  }
  farm_ = welcome.farm;
  name_in_farm_ = welcome.worker;
  send_results_again(actions);
}

void Session::send_results_again(SessionActions& actions) {
  std::vector<const Result*> again;
  for (const auto& [key, result] : results_) {
    again.push_back(&result);
  }
  std::sort(again.begin(), again.end(), [](const Result* a, const Result* b) { return a->sequence < b->sequence; });
  for (const Result* result : again) {
    actions.push_back(SendMessage{result->message});
  }
}

void Session::drop_everything(std::string reason, SessionActions& actions) {
  actions.push_back(LogNotice{std::move(reason)});
  stop_tiles([](const Rendering&) { return true; }, actions);
  while (!leases_.empty()) {
    erase_lease(leases_.begin()->first, actions);
  }
  while (!jobs_.empty()) {
    forget_job(jobs_.begin()->first, actions);
  }
  results_.clear();
  result_bytes_ = 0;
}

void Session::disconnected(Time now, SessionActions& actions, bool refused) {
  if (exited_) {
    return;
  }
  if (link_ == Link::up && welcomed_) {
    backoff_ = config_.reconnect_least;
    refused_backoff_ = config_.refused_least;
  }
  welcomed_ = false;
  link_ = Link::down;
  drop_pilots(actions);
  drop_inspection(actions);
  Duration& backoff = refused ? refused_backoff_ : backoff_;
  next_open_ = now + backoff;
  backoff = std::min(backoff * 2, refused ? config_.refused_most : config_.reconnect_most);
  limit_absence(now);
  advance(actions);
}

void Session::tick(Time now, SessionActions& actions) {
  if (exited_) {
    return;
  }
  if (draining_ && (now >= drain_deadline_ || (away_deadline_ && now >= *away_deadline_))) {
    exit(fmt::format("{}. Dropped tiles, which other workers will render again: {}",
                     link_ != Link::up    ? "the coordinator is away"
                     : rendering_.empty() ? "the coordinator did not acknowledge the last results in time"
                                          : "the last tiles take too long",
                     results_.size() + rendering_.size()),
         false, actions);
    return;
  }
  if (link_ == Link::down && now >= next_open_) {
    link_ = Link::opening;
    actions.push_back(OpenStream{});
  }
  if (link_ == Link::up && now >= next_heartbeat_) {
    next_heartbeat_ = now + heartbeat_interval_;
    WorkerHeartbeat heartbeat;
    heartbeat.longest_wait = std::exchange(longest_wait_, std::nullopt);
    for (const auto& [key, result] : results_) {
      heartbeat.longest_wait = std::max(heartbeat.longest_wait.value_or(Duration::zero()), now - result.sent);
    }
    for (const auto& [id, lease] : leases_) {
      if (!lease.queued.empty() || !lease.rendering.empty()) {
        heartbeat.leases.push_back(id);
      }
    }
    for (const auto& [id, pilot] : pilots_) {
      heartbeat.leases.push_back(id);
      if (pilot.cpu_seconds >= kReportedCpuSeconds) {
        heartbeat.at_work.push_back({id, TileId{0}, pilot.cpu_seconds});
      }
    }
    for (const auto& [ticket, tile] : rendering_) {
      if (tile.wanted && tile.cpu_seconds >= kReportedCpuSeconds) {
        heartbeat.at_work.push_back({tile.lease, tile.key.tile, tile.cpu_seconds});
      }
    }
    send(std::move(heartbeat), actions);
  }
  for (auto& [id, job] : jobs_) {
    if (job.state == Job::State::unavailable && now >= job.retry) {
      job.state = Job::State::preparing;
      actions.push_back(PrepareJob{job.description});
    }
  }
  for (auto& [id, pilot] : pilots_) {
    if (pilot.retry && now >= *pilot.retry) {
      pilot.retry.reset();
      actions.push_back(RunPilot{pilot.grant});
    }
  }
}

std::optional<Time> Session::next_deadline() const {
  if (exited_) {
    return std::nullopt;
  }
  std::optional<Time> next;
  const auto by = [&](Time time) { next = next ? std::min(*next, time) : time; };
  if (draining_) {
    by(away_deadline_ ? std::min(drain_deadline_, *away_deadline_) : drain_deadline_);
  }
  if (link_ == Link::down) {
    by(next_open_);
  }
  if (link_ == Link::up) {
    by(next_heartbeat_);
  }
  for (const auto& [id, job] : jobs_) {
    if (job.state == Job::State::unavailable) {
      by(job.retry);
    }
  }
  for (const auto& [id, pilot] : pilots_) {
    if (pilot.retry) {
      by(*pilot.retry);
    }
  }
  return next;
}

// ---- leaving ----

void Session::drain(Time now, SessionActions& actions) {
  if (!exited_) {
    begin_drain(true, now, actions);
    advance(actions);
  }
}

void Session::begin_drain(bool give_back, Time now, SessionActions& actions) {
  if (!draining_) {
    draining_ = true;
    drop_inspection(actions);
    extend_drain(now);
    if (link_ == Link::up) {
      send(WorkerDraining{}, actions);
    }
    limit_absence(now);
  }
  if (give_back) {
    for (const auto& [id, pilot] : pilots_) {
      send(WorkerReturn{id}, actions);
    }
    drop_pilots(actions);
    for (auto& [id, lease] : leases_) {
      if (!lease.queued.empty()) {
        lease.queued.clear();
        lease.give_back = true;
      }
    }
  }
}

/// Progress was made, so the deadline moves. Tiles with threads get more time.
void Session::extend_drain(Time now) {
  drain_deadline_ = now + config_.drain_limit + (rendering_.empty() ? Duration{} : 2 * longest_tile_);
}

/// Limits the time that a drain waits for a coordinator that is away.
void Session::limit_absence(Time now) {
  if (draining_ && link_ != Link::up && !away_deadline_) {
    away_deadline_ = now + config_.drain_away_limit;
  }
}

void Session::exit(const std::string& reason, bool failed, SessionActions& actions) {
  exited_ = true;
  if (link_ == Link::up) {
    actions.push_back(CloseStream{});
  }
  actions.push_back(Exit{reason, failed});
}

SessionStatus Session::status() const {
  SessionStatus status;
  status.connected = link_ == Link::up;
  status.draining = draining_;
  status.leases = static_cast<std::uint32_t>(leases_.size() + pilots_.size());
  for (const auto& [id, lease] : leases_) {
    status.tiles_queued += static_cast<std::uint32_t>(lease.queued.size());
  }
  status.tiles_rendering = static_cast<std::uint32_t>(rendering_.size());
  status.results_unacknowledged = static_cast<std::uint32_t>(results_.size());
  status.unacknowledged_bytes = result_bytes_;
  status.tiles_rendered = tiles_rendered_;
  return status;
}

}  // namespace lightmill

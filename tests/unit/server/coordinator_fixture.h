// Fixture of a coordinator driven by hand: a clock, immediate commits, and workers that are only names.
#pragma once

#include <gtest/gtest.h>

#include "common/film/film.h"
#include "server/domain/coordinator.h"
#include "server/domain/grant_signer.h"

namespace lightmill::test {

class CoordinatorTest : public ::testing::Test {
 protected:
  explicit CoordinatorTest(StoredState stored = {}) { restart(std::move(stored)); }

  void restart(StoredState stored) { coordinator = std::make_unique<Coordinator>(limits, std::move(stored), now); }

  static JobSpec spec(const std::string& request_id = "r1", std::uint64_t samples = 4,
                      PixelRect crop = {0, 0, 128, 64}) {
    JobSpec spec;
    spec.request_id = request_id;
    spec.name = "box";
    spec.goal.samples = samples;
    spec.settings.scene = "scene";
    spec.settings.width = crop.width;
    spec.settings.height = crop.height;
    spec.settings.crop = crop;
    spec.settings.renderer_version = kRendererVersion;
    return spec;
  }
  JobId submit(const JobSpec& job) {
    const Result<JobId> id = coordinator->submit(job, now, unix_ms(), effects);
    EXPECT_TRUE(id.ok()) << id.status();
    flush();
    return *id;
  }
  SessionId connect(const std::string& name, std::uint32_t threads = 1, const std::string& fingerprint = "class-a",
                    std::vector<HeldLease> held = {}, std::uint32_t pid = 1) {
    const SessionId session{next_session++};
    WorkerHello hello{name, "host", pid, threads, fingerprint, kRendererVersion, std::move(held), false};
    coordinator->worker_connected(session, hello, now, effects);
    flush();
    return session;
  }
  void say(SessionId session, WorkerMessage message) {
    coordinator->worker_message(session, std::move(message), now, unix_ms(), effects);
    flush();
  }
  /// Time passes, and the coordinator is called at its deadlines.
  void pass(Duration time) {
    const Time until = now + time;
    for (auto due = coordinator->next_deadline(); due && *due<until&& * due> now; due = coordinator->next_deadline()) {
      stand_still(*due - now);
    }
    stand_still(until - now);
  }
  /// Time passes in one step, with a tick at its end.
  void stand_still(Duration time) {
    now += time;
    coordinator->tick(now, unix_ms(), effects);
    flush();
  }
  std::int64_t unix_ms() const {
    return std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
  }

  /// A worker's result. Its value depends only on the samples, and is the same in all pixels.
  WorkerResult result(const LeaseGrant& grant, TileId tile, double seconds = 0.01) const {
    WorkerResult result;
    result.lease = grant.lease;
    result.key = {grant.unit.job, tile, grant.unit.range};
    const Film* film = coordinator->film(grant.unit.job);
    result.node = {
        grant.unit.range,
        std::vector<float>(film->expected_values(tile, grant.unit.range), static_cast<float>(grant.unit.range.count())),
        0};
    if (grant.unit.range.first() == 0) {
      // An addition that half B lacks: see first_extra.
      const std::size_t half =
          film->layout().summed * static_cast<std::size_t>(film->grid().tile_rect(tile).pixel_count());
      for (std::size_t i = 0; i < half; ++i) {
        result.node.values[i] += first_extra;
      }
    }
    result.hash = hash_of(result.node);
    result.render_digest = coordinator->status(grant.unit.job, now)->render_digest;
    result.seconds = seconds;
    if (const auto at = std::ranges::find(grant.unit.tiles, tile);
        at != grant.unit.tiles.end() && !grant.tags.empty()) {
      result.tag = grant.tags[static_cast<std::size_t>(at - grant.unit.tiles.begin())];
    }
    return result;
  }
  /// A grant as any coordinator of the same farm makes it.
  static LeaseGrant granted(const std::string& worker, LeaseId lease, const Unit& unit, const Sha256& digest) {
    LeaseGrant grant{lease, unit, {}, {}};
    for (const TileId tile : unit.tiles) {
      grant.tags.push_back(GrantSigner(Sha256{}).tag(worker, lease, digest, {unit.job, tile, unit.range}));
    }
    return grant;
  }
  HeldLease held(const LeaseGrant& grant) const {
    return {grant.lease, 1, coordinator->status(grant.unit.job, now)->render_digest, grant.unit, grant.tags};
  }
  void finish(SessionId session, const LeaseGrant& grant) {
    for (const TileId tile : grant.unit.tiles) {
      say(session, result(grant, tile));
    }
  }
  /// All messages of one kind sent to a session so far.
  template <class T>
  std::vector<T> got(SessionId session) const {
    std::vector<T> found;
    for (const Outgoing& each : sent) {
      if (each.to == session && std::holds_alternative<T>(each.message)) {
        found.push_back(std::get<T>(each.message));
      }
    }
    return found;
  }
  /// Renders all its leases until no more come.
  void work(SessionId session) {
    std::size_t& done = worked[session];
    while (done < got<LeaseGrant>(session).size()) {
      finish(session, got<LeaseGrant>(session)[done++]);
    }
  }
  JobStatus status(JobId job) const { return *coordinator->status(job, now); }

  void flush() {
    coordinator->grants_sent(leases_granted(effects.after_commit), now);
    std::ranges::move(ends_in(effects.writes), std::back_inserter(ends_unstored));
    if (stores_ends) {
      store_ends();
    }
    for (std::vector<Outgoing>* channel : {&effects.now, &effects.after_commit}) {
      sent.insert(sent.end(), channel->begin(), channel->end());
    }
    writes.insert(writes.end(), effects.writes.begin(), effects.writes.end());
    closed.insert(closed.end(), effects.closed.begin(), effects.closed.end());
    film_reads.insert(film_reads.end(), effects.film_reads.begin(), effects.film_reads.end());
    films_told.insert(films_told.end(), effects.films.begin(), effects.films.end());
    effects = {};
  }

  void store_ends() { coordinator->ends_stored(std::exchange(ends_unstored, {})); }

  /// Added to half A by each pixel's first sample. With n samples the halves' means are then 2 + 2·first_extra/n and 2.
  /// So the frame's relMSE is (first_extra/n)² / 4.01 in all pixels alike. The limit r does not include this addition.
  float first_extra = 0;
  CoordinatorLimits limits;
  Time now{std::chrono::seconds(1000)};
  std::unique_ptr<Coordinator> coordinator;
  Effects effects;
  std::vector<Outgoing> sent;
  std::vector<StoreOp> writes;
  bool stores_ends = true;  ///< else store_ends() does it
  std::vector<JobId> ends_unstored;
  std::vector<SessionId> closed;
  std::vector<JobId> film_reads;
  std::vector<FilmOutcome> films_told;
  std::uint64_t next_session = 1;
  std::map<SessionId, std::size_t> worked;  ///< grants that work() has done
};

}  // namespace lightmill::test

// Films of ended jobs: dropped from memory and loaded again.
#include "server/domain/films.h"

#include "tests/support/film_planes.h"
#include "tests/unit/server/audit_fixture.h"

namespace lightmill {
namespace {

constexpr std::uint64_t kFilmBytes = 128 * 64 * 6 * sizeof(float);  // of spec() with a node a tile

/// A coordinator with a store, which shares no memory with it.
class FilmsTest : public test::AuditTest {
 protected:
  /// Stores what was written.
  void commit() {
    for (const StoreOp& op : std::exchange(writes, {})) {
      if (const auto* job = std::get_if<PutJob>(&op)) {
        records_[job->record.id] = job->record;
      } else if (const auto* node = std::get_if<PutNode>(&op)) {
        nodes_[{node->job, node->tile, node->node->range}] = *node->node;
      } else if (const auto* drop = std::get_if<DropNode>(&op)) {
        nodes_.erase(drop->key);
      } else if (const auto* result = std::get_if<PutResult>(&op)) {
        results_[result->key] = *result;
      } else if (const auto* results = std::get_if<DropResults>(&op)) {
        std::erase_if(results_, [&](const auto& entry) {
          return entry.first.job == results->key.job && entry.first.tile == results->key.tile &&
                 results->key.range.contains(entry.first.range);
        });
      }
    }
  }
  StoredFilm stored_film(JobId job) const {
    StoredFilm film;
    for (const auto& [key, node] : nodes_) {
      if (key.job == job) {
        film.emplace_back(key.tile, std::make_shared<const Node>(node));
      }
    }
    return film;
  }
  /// Starts another coordinator from the stored state, without the values of ended jobs' films.
  void start_again() {
    commit();
    StoredState stored{2, {}, records_.rbegin()->first.value + 1};
    for (const auto& [id, record] : records_) {
      StoredState::StoredJob& job = stored.jobs.emplace_back(StoredState::StoredJob{record, stored_film(id)});
      for (StoredState::StoredNode& node : job.nodes) {
        node.node = has_ended(record.state) ? nullptr : node.node;
      }
      for (const auto& [key, result] : results_) {
        if (key.job == id) {
          job.results.push_back(
              {key.tile, key.range, result.hash, static_cast<std::uint32_t>(stored.renderers.size())});
          stored.renderers.push_back(result.by);
        }
      }
    }
    worked.clear();
    sent.clear();
    restart(std::move(stored));
  }

  static JobSpec unaudited(const std::string& request, std::uint64_t samples, PixelRect crop = {0, 0, 128, 64}) {
    JobSpec job = spec(request, samples, crop);
    job.audit_share = 0;
    return job;
  }
  JobId done_job(const std::string& request, std::uint64_t samples = 4, PixelRect crop = {0, 0, 128, 64}) {
    const JobId job = submit(unaudited(request, samples, crop));
    work(worker_);
    EXPECT_EQ(status(job).state, JobState::done);
    commit();
    return job;
  }
  bool in_memory(JobId job) const { return coordinator->film(job) != nullptr; }
  bool use(JobId job) {
    const bool here = coordinator->use_film(job, now, effects).value();
    flush();
    return here;
  }
  /// Answers reads of the store until none is left.
  void answer_reads() {
    while (!film_reads.empty()) {
      const JobId job = film_reads.front();
      film_reads.erase(film_reads.begin());
      coordinator->film_read(job, stored_film(job), now, effects);
      flush();
    }
  }
  void forget_films() {
    pass(limits.film_idle);
    films_told.clear();
  }
  std::vector<std::vector<float>> sums(JobId job) const {
    std::vector<std::vector<float>> all;
    for (TileId tile{0}; tile.value < coordinator->outline(job)->grid().tile_count(); ++tile.value) {
      all.push_back(test::sums_of(*coordinator->film(job), tile));
    }
    return all;
  }

  SessionId worker_ = connect_on("m1", "w");
  std::map<JobId, JobRecord> records_;
  std::map<NodeKey, Node> nodes_;
  std::map<NodeKey, PutResult> results_;
};

TEST_F(FilmsTest, AnUnusedFilmOfAnEndedJobLeavesMemoryAndReturnsWithTheSameBits) {
  first_extra = 16;
  const JobId job = done_job("r1", 64);
  const JobStatus before = status(job);
  const std::vector<std::vector<float>> sums_before = sums(job);
  pass(limits.film_idle - std::chrono::seconds(1));
  EXPECT_TRUE(in_memory(job));
  pass(std::chrono::seconds(1));
  EXPECT_FALSE(in_memory(job));
  const JobStatus after = status(job);
  EXPECT_EQ(after.samples_done, before.samples_done);
  EXPECT_EQ(after.min_tile_samples, 64u);
  EXPECT_TRUE(after.error.known);
  EXPECT_EQ(after.error.rel_mse, before.error.rel_mse);
  EXPECT_EQ(after.error.half_width, before.error.half_width);

  EXPECT_FALSE(use(job));
  EXPECT_FALSE(use(job));
  EXPECT_EQ(film_reads, std::vector{job}) << "it is read once";
  EXPECT_TRUE(films_told.empty());
  answer_reads();
  ASSERT_EQ(films_told.size(), 1u);
  EXPECT_EQ(films_told[0].job, job);
  EXPECT_TRUE(films_told[0].status.ok());
  EXPECT_TRUE(use(job));
  EXPECT_EQ(sums(job), sums_before);
  EXPECT_TRUE(writes.empty());
}

TEST_F(FilmsTest, AHeldFilmStays) {
  const JobId job = done_job("r1");
  NodePtr held = coordinator->film(job)->forest(TileId{1})[0];
  pass(2 * limits.film_idle);
  EXPECT_TRUE(in_memory(job));
  held.reset();
  pass(std::chrono::seconds(1));
  EXPECT_FALSE(in_memory(job));
}

TEST_F(FilmsTest, AnActiveJobsFilmStays) {
  const JobId job = submit(spec("r1", 64));
  finish(worker_, got<LeaseGrant>(worker_)[0]);
  ASSERT_TRUE(coordinator->pause(job, now, effects).ok());
  flush();
  commit();
  pass_with({worker_}, 2 * limits.film_idle);
  EXPECT_TRUE(in_memory(job));
}

TEST_F(FilmsTest, FilmsOfActiveJobsReplaceTheLeastRecentlyUsed) {
  limits.film_bytes = 3 * kFilmBytes;
  restart({});
  worker_ = connect_on("m1", "w");
  const JobId first = done_job("r1"), second = done_job("r2");
  stand_still(std::chrono::seconds(1));
  EXPECT_TRUE(use(first));
  coordinator->worker_disconnected(worker_, now, effects);
  submit(spec("r3"));
  EXPECT_TRUE(in_memory(first) && in_memory(second));
  submit(spec("r4"));
  EXPECT_TRUE(in_memory(first));
  EXPECT_FALSE(in_memory(second));
}

TEST_F(FilmsTest, TheLargestFilmOfAnEndedJobAlwaysHasRoom) {
  limits.film_bytes = 3 * kFilmBytes;
  restart({});
  worker_ = connect_on("m1", "w");
  const JobId large = done_job("r1", 4, {0, 0, 256, 64});
  done_job("r2");
  coordinator->worker_disconnected(worker_, now, effects);
  submit(spec("r3"));
  const Status refused = coordinator->submit(spec("r4"), now, 0, effects).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(message_of(refused).find("--films-gib"), std::string::npos) << refused;
  use(large);
  answer_reads();
  EXPECT_TRUE(in_memory(large));
  ASSERT_TRUE(coordinator->remove(large, now, effects).ok());
  EXPECT_TRUE(coordinator->submit(spec("r4"), now, 0, effects).ok());
}

TEST_F(FilmsTest, OneOwnersFilmsLeaveTheDiskToOthers) {
  limits.film_bytes_per_owner = 2 * kFilmBytes;
  restart({});
  worker_ = connect_on("m1", "w");
  const JobId first = done_job("r1");
  done_job("r2");
  const Status refused = coordinator->submit(spec("r3"), now, 0, effects).status();
  EXPECT_EQ(refused.code(), StatusCode::kResourceExhausted);
  EXPECT_NE(message_of(refused).find("--user-disk-gib"), std::string::npos) << refused;
  EXPECT_EQ(coordinator->extend(first, {.samples = 5}, now, effects).code(), StatusCode::kResourceExhausted);
  EXPECT_TRUE(coordinator->extend(first, {.samples = 8}, now, effects).ok()) << "it replaces its film";
  JobSpec other = spec("r4");
  other.owner = "another";
  EXPECT_TRUE(coordinator->submit(other, now, 0, effects).ok());
  ASSERT_TRUE(coordinator->discard(first, now, 0, effects).ok());
  EXPECT_TRUE(coordinator->submit(spec("r3"), now, 0, effects).ok());
}

TEST_F(FilmsTest, FilmsAreReadOneAtATime) {
  limits.film_idle = {};
  restart({});
  worker_ = connect_on("m1", "w");
  const JobId first = done_job("r1"), second = done_job("r2");
  stand_still(std::chrono::seconds(1));
  use(first);
  use(second);
  EXPECT_EQ(film_reads, std::vector{first});
  coordinator->film_read(first, stored_film(first), now, effects);
  EXPECT_TRUE(in_memory(first)) << "until its waiting callers have an answer";
  flush();
  EXPECT_EQ(film_reads, std::vector{first});
  stand_still({});
  EXPECT_EQ(film_reads, (std::vector{first, second}));
}

TEST_F(FilmsTest, AFilmWaitsForRoomAndALongWaitIsReported) {
  limits.film_bytes = 2 * kFilmBytes;
  restart({});
  worker_ = connect_on("m1", "w");
  const JobId jobs[] = {done_job("r1"), done_job("r2"), done_job("r3")};
  forget_films();
  std::vector<NodePtr> held;
  for (const JobId job : {jobs[0], jobs[1]}) {
    use(job);
    answer_reads();
    held.push_back(coordinator->film(job)->forest(TileId{0})[0]);
  }
  films_told.clear();
  use(jobs[2]);
  EXPECT_TRUE(film_reads.empty()) << "two films are on their way to clients";
  pass(std::chrono::seconds(29));
  EXPECT_TRUE(films_told.empty());
  pass(std::chrono::seconds(1));
  ASSERT_EQ(films_told.size(), 1u);
  EXPECT_EQ(films_told[0].status.code(), StatusCode::kResourceExhausted) << films_told[0].status;
  use(jobs[2]);
  held.pop_back();
  pass(std::chrono::seconds(1));
  EXPECT_EQ(film_reads, std::vector{jobs[2]});
  EXPECT_TRUE(in_memory(jobs[0]));
  EXPECT_FALSE(in_memory(jobs[1]));
}

TEST_F(FilmsTest, OnlyADamagedFilmIsToBeRestoredOrDeleted) {
  const JobId job = done_job("r1");
  forget_films();
  for (const auto& [status, advises] :
       {std::pair{data_loss("a page is damaged"), true}, {unavailable("no connection"), false}}) {
    use(job);
    effects.notes.clear();
    coordinator->film_read(job, status, now, effects);
    ASSERT_EQ(effects.notes.size(), 1u);
    EXPECT_EQ(effects.notes[0].text.find("delete the job") != std::string::npos, advises) << effects.notes[0].text;
    flush();
  }
}

TEST_F(FilmsTest, AnUnreadableFilmIsReported) {
  const JobId job = done_job("r1");
  forget_films();
  use(job);
  film_reads.clear();
  coordinator->film_read(job, data_loss("/var/lib/farm.sqlite: a page is damaged"), now, effects);
  flush();
  ASSERT_EQ(films_told.size(), 1u);
  EXPECT_EQ(films_told[0].status.code(), StatusCode::kDataLoss);
  EXPECT_EQ(
      message_of(films_told[0].status),
      "the film of job 1 cannot be read from the farm's store: ask the farm's administrator, who finds the reason "
      "in the coordinator's log");
  EXPECT_EQ(status(job).state, JobState::done);
  use(job);
  EXPECT_EQ(film_reads, std::vector{job}) << "each request tries again";
  ASSERT_TRUE(coordinator->remove(job, now, effects).ok());
  answer_reads();
  EXPECT_EQ(films_told.back().status.code(), StatusCode::kNotFound);
}

TEST_F(FilmsTest, AnExtendedJobResumesFromTheStoredFilm) {
  const JobId whole = done_job("r1", 12), job = done_job("r2", 4);
  forget_films();
  EXPECT_EQ(coordinator->extend(job, {12}, now, effects).code(), StatusCode::kUnavailable);
  use(job);
  answer_reads();
  ASSERT_TRUE(coordinator->extend(job, {12}, now, effects).ok());
  flush();
  worker_ = connect_on("m1", "w");
  work(worker_);
  EXPECT_EQ(status(job).state, JobState::done);
  use(whole);
  answer_reads();
  EXPECT_EQ(sums(job), sums(whole));
}

TEST_F(FilmsTest, ADamagedNodeOfADoneJobIsRenderedAgain) {
  const JobId job = done_job("r1");
  const std::vector<std::vector<float>> before = sums(job);
  forget_films();
  const NodeKey damaged{job, TileId{1}, {2, 0}};
  const Node whole = nodes_.at(damaged);
  nodes_.erase(damaged);
  use(job);
  answer_reads();
  EXPECT_EQ(status(job).state, JobState::running);
  EXPECT_EQ(status(job).samples_done, 4u * 64 * 64);
  EXPECT_EQ(written<DropNode>(), 1u);
  EXPECT_EQ(written<DropResults>(), 1u);
  commit();
  EXPECT_TRUE(std::ranges::none_of(results_, [](const auto& entry) { return entry.first.tile == TileId{1}; }));
  worker_ = connect_on("m1", "w");
  work(worker_);
  EXPECT_EQ(status(job).state, JobState::done);
  EXPECT_EQ(sums(job), before);
  commit();
  EXPECT_EQ(hash_of(nodes_.at(damaged)), hash_of(whole));
}

TEST_F(FilmsTest, ALostNodeOfACancelledJobStaysLost) {
  const JobId job = submit(spec("r1", 64));
  finish(worker_, got<LeaseGrant>(worker_)[0]);
  ASSERT_TRUE(coordinator->cancel(job, now, unix_ms(), effects).ok());
  flush();
  commit();
  const std::uint64_t before = status(job).samples_done;
  forget_films();
  nodes_.erase(nodes_.begin());
  use(job);
  answer_reads();
  EXPECT_TRUE(in_memory(job));
  EXPECT_EQ(status(job).state, JobState::cancelled);
  EXPECT_LT(status(job).samples_done, before);
  EXPECT_EQ(written<DropNode>(), 1u);
}

/// A machine's work is undone while the film is only in the store. The store drops it at once. The job resumes when the
/// film is in memory.
TEST_F(FilmsTest, WorkIsUndoneInAStoredFilm) {
  for (const bool killed : {false, true}) {
    SCOPED_TRACE(killed);
    const SessionId other = connect_on("m2", "other");
    const JobId job = submit(unaudited(killed ? "r2" : "r1", 1));
    ASSERT_EQ(got<LeaseGrant>(other).size(), 1u) << "each has a tile";
    work(worker_);
    work(other);
    ASSERT_EQ(status(job).state, JobState::done);
    commit();
    const std::vector<std::vector<float>> before = sums(job);
    forget_films();
    ASSERT_FALSE(in_memory(job));
    ASSERT_TRUE(coordinator->quarantine_worker("w", std::string(kByHand) + "hand", true, now, effects).ok());
    flush();
    commit();
    EXPECT_EQ(stored_film(job).size(), 1u);
    EXPECT_EQ(status(job).samples_done, 64u * 64);
    if (killed) {
      film_reads.clear();
      start_again();
    }
    stand_still({});
    ASSERT_EQ(film_reads, std::vector{job});
    answer_reads();
    EXPECT_EQ(status(job).state, JobState::running);
    const SessionId third = connect_on("m3", "third");
    work(third);
    EXPECT_EQ(status(job).state, JobState::done);
    EXPECT_EQ(sums(job), before);
    if (!killed) {
      ASSERT_TRUE(coordinator->release_worker("w", now, effects).ok());
      coordinator->worker_disconnected(third, now, effects);
      flush();
      commit();
      worker_ = connect_on("m1", "w");
    }
  }
}

TEST_F(FilmsTest, AStartingCoordinatorLeavesFilmsInTheStore) {
  first_extra = 16;
  const JobId done = done_job("r1", 64), active = submit(spec("r2", 64));
  finish(worker_, got<LeaseGrant>(worker_).back());
  const JobStatus before = status(done);
  start_again();
  EXPECT_FALSE(in_memory(done));
  EXPECT_TRUE(in_memory(active));
  EXPECT_EQ(status(done).samples_done, before.samples_done);
  EXPECT_EQ(status(done).error.rel_mse, before.error.rel_mse);
  EXPECT_TRUE(status(done).error.known);
}

TEST_F(FilmsTest, AFilmRenderedAgainWithOtherBitsHasAnotherError) {
  first_extra = 32;  // a lie
  const JobId job = done_job("r1", 64);
  const double wrong = status(job).error.rel_mse;
  ASSERT_TRUE(coordinator->quarantine_worker("w", std::string(kByHand) + "hand", true, now, effects).ok());
  flush();
  first_extra = 16;
  const SessionId other = connect_on("m2", "other");
  work(other);
  ASSERT_EQ(status(job).state, JobState::done);
  const double right = status(job).error.rel_mse;
  EXPECT_LT(right, wrong);
  commit();
  forget_films();
  EXPECT_FALSE(in_memory(job));
  EXPECT_TRUE(status(job).error.known);
  EXPECT_EQ(status(job).error.rel_mse, right);
  EXPECT_EQ(status(job).history.back().rel_mse, right);
}

}  // namespace
}  // namespace lightmill

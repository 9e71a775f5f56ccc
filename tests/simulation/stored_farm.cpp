#include "tests/simulation/stored_farm.h"

#include <algorithm>

#include "common/base/check.h"
#include "server/store/asset_folder.h"
#include "server/store/check_rows.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/simulation/fake_renderer.h"
#include "tests/simulation/worker_side.h"

namespace lightmill::simulation {
namespace {

constexpr std::uint64_t kWorkers = 2;
constexpr int kMaxSteps = 2000;
constexpr std::uint64_t kAll = ~std::uint64_t{0};

std::int64_t unix_ms(Time now) {
  return std::chrono::duration_cast<std::chrono::milliseconds>(now.time_since_epoch()).count();
}

}  // namespace

StoredJob draw_job(std::uint64_t number, const std::map<Sha256, std::string>& assets, Random& random) {
  constexpr PixelRect kCrops[] = {{60, 60, 8, 8}, {0, 0, 3, 2}, {62, 10, 70, 1}, {0, 61, 2, 70}};
  constexpr std::uint64_t kGoals[] = {1, 3, 7, 16, 33};
  constexpr double kShares[] = {0, 0.3, 1};
  StoredJob job;
  job.spec.request_id = fmt::format("request-{}", number);
  job.spec.goal.samples = kGoals[random.below(std::size(kGoals))];
  job.spec.audit_share = kShares[random.below(std::size(kShares))];
  RenderSettings& settings = job.spec.settings;
  settings.scene = fmt::format("scene {}", number);
  settings.width = settings.height = 200;
  settings.crop = kCrops[random.below(std::size(kCrops))];
  settings.seed = random.below(3);
  settings.renderer_version = kRendererVersion;
  std::vector<Sha256> used;
  for (const auto& [digest, bytes] : assets) {
    if (random.chance(0.6)) {
      used.push_back(digest);
    }
  }
  settings.assets = std::move(used);
  if (random.chance(0.3)) {
    settings.layers = *film_layers(std::vector<std::string>{"normal", "depth"});
  }
  if (random.chance(0.4)) {
    settings.method = "auto";
    job.methods = {"path", "path:brute-force"};
    job.spec.goal.adaptive = random.chance(0.5);
  }
  return job;
}

std::optional<WorkerResult> render(const LeaseGrant& grant, std::size_t i, const Coordinator& farm, Time now) {
  const TileId tile = grant.unit.tiles[i];
  const Result<JobStatus> status = farm.status(grant.unit.job, now);
  if (!status.ok() || status->render_digest == Sha256{}) {
    return std::nullopt;
  }
  const FilmOutline& film = *farm.outline(grant.unit.job);
  WorkerResult result;
  result.lease = grant.lease;
  result.key = {grant.unit.job, tile, grant.unit.range};
  result.node =
      *shared_renderer().node(status->render_digest, tile, grant.unit.range,
                              static_cast<std::size_t>(film.grid().tile_rect(tile).pixel_count()), film.layout());
  result.hash = hash_of(result.node);
  result.render_digest = status->render_digest;
  result.seconds = 0.01;
  result.tag = grant.tags.at(i);
  return result;
}

PilotReport pilot_report(const PilotGrant& grant) {
  return {grant.lease,
          static_cast<std::uint32_t>(pilot_choice(grant.settings, grant.methods.size())),
          {"as it is"},
          0.1,
          grant.allocate ? pilot_allocation(grant.settings) : Allocation()};
}

Result<std::unique_ptr<StoredFarm>> StoredFarm::start(const std::filesystem::path& folder, bool accept_loss,
                                                      const std::map<Sha256, std::string>& sendable) {
  std::unique_ptr<StoredFarm> farm(new StoredFarm);
  farm->sendable_ = sendable;
  LM_ASSIGN_OR_RETURN(farm->assets_, open_asset_folder(folder / "assets", {}));
  LM_ASSIGN_OR_RETURN(farm->store_, open_sqlite_store(database_of(folder), {.accept_loss = accept_loss}));
  LM_ASSIGN_OR_RETURN(StoredState state, farm->store_->load());
  std::vector<StoreOp> repairs;
  LM_RETURN_IF_ERROR(remove_invalid_rows(state, repairs));
  report_lost_nodes(state);
  if (!repairs.empty()) {
    LM_RETURN_IF_ERROR(farm->store_->commit(repairs));
  }
  farm->loaded_ = state;
  CoordinatorLimits limits;
  limits.restart_grace = Duration{0};  // its workers hold nothing
  farm->coordinator_ = std::make_unique<Coordinator>(limits, std::move(state), farm->now_);
  for (std::uint64_t i = 0; i < kWorkers; ++i) {
    Effects effects;
    WorkerHello hello{fmt::format("worker-{}", i), "host", 1, 1, kUsualClass, kRendererVersion, {}, false};
    hello.identity = fmt::format("identity-{}", i);
    farm->coordinator_->worker_connected(SessionId{1 + i}, hello, farm->now_, effects);
    farm->settle(effects);
  }
  return farm;
}

void StoredFarm::settle(Effects& effects) {
  if (!effects.writes.empty()) {
    const Status status = store_->commit(effects.writes);
    LM_CHECK(status.ok(), "{}", message_of(status));
  }
  coordinator_->grants_sent(leases_granted(effects.after_commit), now_);
  coordinator_->ends_stored(ends_in(effects.writes));
  for (const std::vector<Outgoing>* channel : {&effects.now, &effects.after_commit}) {
    for (const Outgoing& message : *channel) {
      given_.push_back({message.to, message.message});
    }
  }
  for (const JobId job : effects.film_reads) {
    Effects more;
    read_film(job, more);
    settle(more);
  }
}

void StoredFarm::read_film(JobId job, Effects& effects) {
  StoredFilm film;
  for (std::optional<FilmPosition> last = FilmPosition{}; last;) {
    Result<FilmPiece> piece = store_->read_film(job, *last);
    if (!piece.ok()) {
      return coordinator_->film_read(job, piece.status(), now_, effects);
    }
    std::ranges::move(piece->nodes, std::back_inserter(film));
    last = piece->last;
  }
  coordinator_->film_read(job, std::move(film), now_, effects);
  const Result<JobStatus> status = coordinator_->status(job, now_);
  found_damage_later_ = found_damage_later_ || (status.ok() && !has_ended(status->state));
}

void StoredFarm::pass(Duration time) {
  now_ += time;
  for (std::uint64_t i = 0; i < kWorkers; ++i) {
    say(SessionId{1 + i}, WorkerHeartbeat{});
  }
  Effects effects;
  coordinator_->tick(now_, unix_ms(now_), effects);
  settle(effects);
}

void StoredFarm::say(SessionId from, WorkerMessage message) {
  Effects effects;
  coordinator_->worker_message(from, std::move(message), now_, unix_ms(now_), effects);
  settle(effects);
}

void StoredFarm::send_assets() {
  for (const auto& [digest, bytes] : sendable_) {
    if (assets_->has(digest)) {
      continue;
    }
    const auto upload = assets_->start_upload(digest).value();
    LM_CHECK(upload->append(as_byte_view(bytes)).ok() && upload->finish().ok());
  }
}

void StoredFarm::fetch(const Sha256& digest) {
  const Result<std::unique_ptr<AssetStore::Reader>> reader = assets_->open_asset(digest);
  if (reader.ok()) {
    Sha256Hasher hasher;
    for (;;) {
      const Result<std::string> piece = (*reader)->next(1 << 16);
      if (!piece.ok() || piece->empty()) {
        break;
      }
      hasher.append(*piece);
    }
    if (hasher.finish() == digest) {
      return;
    }
    assets_->forget(**reader);
  }
  ++sent_again_;
  send_assets();
}

void StoredFarm::fetch_assets() {
  std::ranges::for_each(coordinator_->assets(), [&](const Sha256& digest) { fetch(digest); });
}

JobId StoredFarm::submit(const StoredJob& job) {
  Effects effects;
  MethodNotes notes;
  notes.candidates = job.methods;
  const Result<JobId> id = coordinator_->submit(job.spec, now_, unix_ms(now_), effects, notes);
  LM_CHECK(id.ok(), "{}", message_of(id.status()));
  settle(effects);
  return *id;
}

void StoredFarm::commit(std::vector<StoreOp> ops) {
  LM_CHECK(store_->commit(ops).ok());
}

void StoredFarm::answer(const Given& given) {
  if (const auto* const job = std::get_if<JobDescription>(&given.message)) {
    std::ranges::for_each(*job->settings.assets, [&](const Sha256& digest) { fetch(digest); });
  } else if (const auto* const pilot = std::get_if<PilotGrant>(&given.message)) {
    std::ranges::for_each(*pilot->settings.assets, [&](const Sha256& digest) { fetch(digest); });
    say(given.to, pilot_report(*pilot));
  } else if (const auto* const grant = std::get_if<LeaseGrant>(&given.message)) {
    for (std::size_t i = 0; i < grant->unit.tiles.size() && left_ > 0; ++i) {
      if (std::optional<WorkerResult> result = render(*grant, i, *coordinator_, now_)) {
        --left_;
        ++rendered_;
        say(given.to, *std::move(result));
      }
    }
  }
}

void StoredFarm::work(std::uint64_t most_results) {
  left_ = most_results;
  for (int idle = 0; left_ > 0 && idle < 2;) {
    if (given_.empty()) {
      pass(std::chrono::milliseconds(500));
      ++idle;
      continue;
    }
    const Given given = std::move(given_.front());
    given_.pop_front();
    answer(given);
    idle = 0;
  }
}

std::string StoredFarm::finish() {
  std::string waits;
  for (int step = 0; step < kMaxSteps; ++step) {
    waits.clear();
    for (const JobStatus& job : coordinator_->jobs(now_)) {
      if (!has_ended(job.state)) {
        waits += fmt::format("job {} is not done: {}", job.id.value, job.reason);
        continue;
      }
      Effects effects;
      if (!coordinator_->use_film(job.id, now_, effects).value_or(true)) {
        waits += fmt::format("the film of job {} is not read", job.id.value);
      }
      settle(effects);
    }
    if (waits.empty()) {
      return "";
    }
    work(kAll);
  }
  return waits;
}

std::string StoredFarm::wrong_films(const std::map<JobId, StoredJob>& jobs) const {
  for (const JobStatus& status : coordinator_->jobs({})) {
    const auto submitted = jobs.find(status.id);
    if (submitted == jobs.end()) {
      return fmt::format("job {} was never submitted", status.id.value);
    }
    const StoredJob& job = submitted->second;
    RenderSettings settings = job.spec.settings;
    if (!job.methods.empty()) {
      settings.method = job.methods[pilot_choice(settings, job.methods.size())];
    }
    const Sha256 digest = render_digest(settings, kUsualClass);
    const Film& film = *coordinator_->film(status.id);
    for (TileId tile{0}; tile.value < film.grid().tile_count(); ++tile.value) {
      const auto pixels = static_cast<std::size_t>(film.grid().tile_rect(tile).pixel_count());
      const std::uint64_t samples =
          (job.spec.goal.adaptive ? pilot_allocation(settings) : Allocation()).of_tile(tile, job.spec.goal.samples);
      const std::vector<NodePtr> quiet = shared_renderer().forest(digest, tile, samples, pixels, film.layout());
      const bool same = std::ranges::equal(film.forest(tile), quiet, [](const NodePtr& a, const NodePtr& b) {
        return a->range == b->range && a->values == b->values;
      });
      if (status.state != JobState::done || !same) {
        return fmt::format("job {}, tile {} does not have the bits of the run without damage", status.id.value,
                           tile.value);
      }
    }
  }
  return "";
}

}  // namespace lightmill::simulation

#include "server/runtime/runtime.h"

#include <unistd.h>

#include <future>
#include <set>

#include "common/base/log.h"
#include "common/base/number_text.h"
#include "server/runtime/action_records.h"
#include "server/store/check_rows.h"

namespace lightmill {
namespace {

/// Unused assets stay for a day, because their jobs may still be submitted.
constexpr std::int64_t kSpareAssetAgeSeconds = 24 * 60 * 60;
/// Longest wait for the farm thread, which may stand still while nothing can be stored. The deletion can wait.
constexpr std::chrono::seconds kFarmTimeout(5);

std::set<Sha256> assets_of(const StoredState& state) {
  std::set<Sha256> wanted;
  for (const StoredState::StoredJob& job : state.jobs) {
    const std::vector<Sha256>& named = *job.record.spec.settings.assets;
    wanted.insert(named.begin(), named.end());
  }
  return wanted;
}

/// The store does not know who sent an asset. So it counts for the owner of the first job that names it.
void attribute_assets(AssetStore& assets, const StoredState& state) {
  std::set<Sha256> seen;
  for (const StoredState::StoredJob& job : state.jobs) {
    for (const Sha256& asset : *job.record.spec.settings.assets) {
      if (seen.insert(asset).second) {
        (void)assets.attribute(asset, job.record.spec.owner, UserLimit::ignored);
      }
    }
  }
}

/// Jobs that end with their page: no page's connection outlives its coordinator.
std::vector<JobId> jobs_of_pages(const StoredState& state) {
  std::vector<JobId> jobs;
  for (const StoredState::StoredJob& job : state.jobs) {
    if (job.record.spec.ends_with_page) {
      jobs.push_back(job.record.id);
    }
  }
  return jobs;
}

void forget_others(AssetStore& assets, const std::set<Sha256>& wanted) {
  if (const std::uint64_t freed_bytes = assets.collect(wanted, kSpareAssetAgeSeconds); freed_bytes > 0) {
    spdlog::info("deleted {} MiB of assets that no job uses", freed_bytes >> 20);
  }
}

/// Refused calls go into the action log.
void record_refusals(AccessControl& access, FarmLoop& loop) {
  access.set_on_refused([&access, &loop](const Call& call, const CallSubject& about, const Status& status) {
    if (const std::optional<SuppressedRefusals> suppressed = access.may_record_refusal(call, about, status)) {
      (void)loop.post([call, about, status, suppressed = *suppressed](FarmLoop::TaskContext& context) {
        record_refusal(context, call, about, status, suppressed);
      });
    }
  });
}

/// Callers are asked for tokens, and there is none. Only a caller with a role can create the first one.
void warn_if_nobody_has_access(const AccessOptions& access, const StoredState& state) {
  if (access.authenticates && !access.accepts_certificates && state.tokens.empty()) {
    spdlog::warn(
        "no caller can use this farm, because it requires tokens and has none. End it, start it once on a loopback address "
        "without authentication, and create one: lightmill tokens create NAME --roles admin");
  }
}

}  // namespace

std::string uploader(const Identity& caller) {
  const bool only_renders =
      caller.roles.has(Role::worker) && !caller.roles.has_any({Role::submit, Role::operate, Role::admin});
  return !caller.is_known() ? "" : only_renders ? std::string(kUploadsOfWorkers) : caller.name;
}

Result<std::unique_ptr<Runtime>> Runtime::start(std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
                                                const RuntimeOptions& options) {
  LM_ASSIGN_OR_RETURN(StoredState state, store->load());
  std::vector<StoreOp> repairs;
  LM_RETURN_IF_ERROR(remove_invalid_rows(state, repairs));
  report_lost_nodes(state);
  if (!repairs.empty()) {
    LM_RETURN_IF_ERROR(store->commit(repairs));
  }
  forget_others(*assets, assets_of(state));
  attribute_assets(*assets, state);
  if (state.epoch == 1) {
    spdlog::info("this is a new farm: its store was empty");
  }
  spdlog::info("epoch {}, {} in the store", state.epoch, counted(state.jobs.size(), "job"));
  warn_if_nobody_has_access(options.access, state);
  return std::unique_ptr<Runtime>(new Runtime(options, std::move(store), std::move(assets), state));
}

Runtime::Runtime(const RuntimeOptions& options, std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
                 StoredState& state)
    : options_(options),
      store_(std::move(store)),
      assets_(std::move(assets)),
      asset_checker_(*assets_),
      start_(fmt::format("epoch {}, process {}", state.epoch, ::getpid())),
      of_pages_(jobs_of_pages(state)),
      access_(options.access, std::move(state.tokens), system_clock()),
      actions_(options.log, std::move(state.actions)),
      farm_(options.limits, std::move(state), system_clock().now()),
      loop_(farm_, actions_, *store_, system_clock(), options.on_fatal) {
  record_refusals(access_, loop_);
}

Runtime::~Runtime() {
  if (begun_) {
    (void)stop();
  }
}

void Runtime::begin() {
  begun_ = true;
  loop_.post_always([this](FarmLoop::TaskContext& context) {
    record_own(context, context.actions.coordinator_is_active() ? kTakeOver : kStart, start_);
    for (const JobId job : of_pages_) {
      context.farm.discard(job, context.now, context.unix_ms, context.effects).IgnoreError();
    }
  });
}

void Runtime::forget_unused_assets() {
  const auto wanted = std::make_shared<std::promise<std::set<Sha256>>>();
  std::future<std::set<Sha256>> answer = wanted->get_future();
  if (loop_.post([wanted](FarmLoop::TaskContext& context) { wanted->set_value(context.farm.assets()); }) &&
      answer.wait_for(kFarmTimeout) == std::future_status::ready) {
    forget_others(*assets_, answer.get());
  }
}

void Runtime::check_assets_of_same_jobs(const Sha256& damaged) {
  (void)loop_.post(
      [this, damaged](FarmLoop::TaskContext& context) { asset_checker_.check(context.farm.assets(damaged)); });
}

Status Runtime::stop() {
  if (std::exchange(begun_, false)) {
    loop_.post_always(
        [](FarmLoop::TaskContext& context) { record_own(context, kStop, fmt::format("process {}", ::getpid())); });
  }
  return loop_.stop();
}

}  // namespace lightmill

#include "worker/render/preparer.h"

#include "common/base/log.h"
#include "common/base/number_text.h"
#include "common/methods/spec/method_spec.h"
#include "common/planner/pilot.h"
#include "common/planner/tile_noise.h"
#include "common/wire/scene_proto.h"
#include "worker/render/scene_limits.h"

namespace lightmill {
namespace {

/// Key of the settings that affect the compiled scene.
Sha256 scene_key(const RenderSettings& settings, const MethodSpec& method) {
  Sha256Hasher hasher;
  hasher.append(fmt::format("{}x{} {} {} ", settings.width, settings.height, method.brute_force ? "brute-force" : "",
                            method.no_absorption ? "no-absorption" : ""));
  hasher.append(*settings.scene);
  return hasher.finish();
}

}  // namespace

Preparer::Preparer(AssetCache& assets, SceneCacheLimits kept, const SceneLimits& limits, const DecoderOptions& decoder,
                   Done done, PilotDone pilot_done)
    : assets_(assets),
      limits_(limits),
      scenes_(kept),
      decoder_(decoder),
      done_(std::move(done)),
      pilot_done_(std::move(pilot_done)),
      thread_([this] { work(); }) {}

Preparer::~Preparer() {
  {
    const MutexLock lock(mutex_);
    stopping_ = true;
    stop_.request_stop();
    changed_.notify_one();
  }
  thread_.join();
}

void Preparer::add(std::shared_ptr<const JobDescription> description) {
  {
    const MutexLock lock(mutex_);
    remove_waiting(description->job);
    unwanted_ = unwanted_ && running_job_ != description->job;  // its scene will be in the cache
  }
  enqueue(std::move(description));
}

void Preparer::add(std::shared_ptr<const PilotGrant> pilot) {
  drop(pilot->lease);
  enqueue(std::move(pilot));
}

void Preparer::enqueue(Task task) {
  const MutexLock lock(mutex_);
  waiting_.push_back(std::move(task));
  stop_if_unwanted();
  changed_.notify_one();
}

void Preparer::stop_if_unwanted() {
  if (unwanted_ && !waiting_.empty()) {
    stop_.request_stop();
  }
}

void Preparer::drop(JobId job) {
  const MutexLock lock(mutex_);
  remove_waiting(job);
  unwanted_ = unwanted_ || running_job_ == job;
  stop_if_unwanted();
}

void Preparer::remove_waiting(JobId job) {
  std::erase_if(waiting_, [job](const Task& task) {
    const auto* description = std::get_if<std::shared_ptr<const JobDescription>>(&task);
    return description != nullptr && (*description)->job == job;
  });
}

void Preparer::drop(LeaseId pilot) {
  const MutexLock lock(mutex_);
  std::erase_if(waiting_, [pilot](const Task& task) {
    const auto* grant = std::get_if<std::shared_ptr<const PilotGrant>>(&task);
    return grant != nullptr && (*grant)->lease == pilot;
  });
  if (running_pilot_ == pilot) {
    stop_.request_stop();
  }
}

std::optional<std::pair<LeaseId, double>> Preparer::pilot_at_work() const {
  const MutexLock lock(mutex_);
  return running_pilot_ ? std::optional(std::pair(*running_pilot_, pilot_cpu_->seconds())) : std::nullopt;
}

void Preparer::drop_caches() {
  enqueue(DropCaches{});
}

void Preparer::clear_caches() {
  scenes_.clear();
  assets_.clear();
}

template <class Make>
auto Preparer::within_memory(const Make& make) -> decltype(make()) {
  return within_limits("the scene was prepared", [&]() -> decltype(make()) {
    try {
      return make();
    } catch (const std::bad_alloc&) {
      clear_caches();
    }
    return make();
  });
}

void Preparer::work() {
  for (;;) {
    Task task;
    std::stop_token stop;
    {
      const MutexLock lock(mutex_);
      running_pilot_.reset();
      running_job_.reset();
      unwanted_ = false;
      while (waiting_.empty() && !stopping_) {
        changed_.wait(mutex_);
      }
      if (stopping_) {
        return;
      }
      task = std::move(waiting_.front());
      waiting_.pop_front();
      if (const auto* pilot = std::get_if<std::shared_ptr<const PilotGrant>>(&task)) {
        running_pilot_ = (*pilot)->lease;
        pilot_cpu_.emplace();
      } else if (const auto* description = std::get_if<std::shared_ptr<const JobDescription>>(&task)) {
        running_job_ = (*description)->job;
      }
      stop_ = std::stop_source();
      stop = stop_.get_token();
    }
    if (auto* description = std::get_if<std::shared_ptr<const JobDescription>>(&task)) {
      Result<PreparedJob> prepared = within_memory([&] { return prepare(**description, stop); });
      if (!stop.stop_requested()) {
        done_(std::move(*description), std::move(prepared));
      }
    } else if (const auto* pilot = std::get_if<std::shared_ptr<const PilotGrant>>(&task)) {
      Result<PilotReport> report = within_memory([&] { return run(**pilot, stop); });
      if (!stop.stop_requested()) {
        pilot_done_((*pilot)->lease, std::move(report));
      }
    } else {
      clear_caches();
    }
  }
}

Result<PilotReport> Preparer::run(const PilotGrant& pilot, const std::stop_token& stop) {
  const RenderSettings& settings = pilot.settings;
  LM_ASSIGN_OR_RETURN(const std::shared_ptr<const CompiledScene> scene, compiled(settings, stop));
  const Time start = system_clock().now();
  PilotChoice choice;
  if (pilot.methods.size() > 1) {
    LM_ASSIGN_OR_RETURN(
        choice,
        run_pilot(scene, {pilot.methods, settings.seed, settings.max_bounces, {0, 0, settings.width, settings.height}},
                  stop));
  }
  const std::string& method = pilot.methods[choice.choice];
  PilotReport report{pilot.lease, static_cast<std::uint32_t>(choice.choice), std::move(choice.reasons)};
  if (pilot.allocate) {
    LM_ASSIGN_OR_RETURN(AllocationResult result,
                        find_allocation(scene, {method, settings.seed, settings.max_bounces, grid_of(settings)}, stop));
    report.reasons.push_back(describe(result));
    report.allocation = std::move(result.allocation);
  }
  report.seconds = to_seconds(system_clock().now() - start);
  spdlog::info("pilot of job {}: {} after {:.0f} ms", pilot.job.value, method, 1000 * report.seconds);
  return report;
}

Result<PreparedJob> Preparer::prepare(const JobDescription& description, const std::stop_token& stop) {
  const RenderSettings& settings = description.settings;
  LM_ASSIGN_OR_RETURN(std::shared_ptr<const CompiledScene> scene, compiled(settings, stop));
  if (settings.meters > 0 && settings.meters != scene->meters().size()) {
    return invalid_argument("the job asks for {}, but its scene has {}", counted(settings.meters, "meter"),
                            scene->meters().size());
  }
  LM_ASSIGN_OR_RETURN(
      std::unique_ptr<Method> method,
      make_method(std::move(scene), {settings.method, settings.seed, settings.max_bounces, settings.layers}));
  return PreparedJob{grid_of(settings), std::move(method)};
}

Result<std::shared_ptr<const CompiledScene>> Preparer::compiled(const RenderSettings& settings,
                                                                const std::stop_token& stop) {
  LM_ASSIGN_OR_RETURN(const MethodSpec method, parse_method(settings.method));
  const Sha256 key = scene_key(settings, method);
  if (std::shared_ptr<const CompiledScene> known = scenes_.find(key); known != nullptr) {
    return known;
  }
  const Time start = system_clock().now();
  LM_ASSIGN_OR_RETURN(Scene document, unpack_scene(*settings.scene));
  document.film.width = settings.width;
  document.film.height = settings.height;
  if (method.no_absorption) {
    remove_absorption(document);
  }
  Duration fetching{};
  const auto may_continue = [&] {
    return stop.stop_requested() ? cancelled("the scene is not needed any more")
           : to_seconds(system_clock().now() - start - fetching) <= limits_.seconds
               ? ok_status()
               : resource_exhausted("the scene takes longer to prepare than --scene-seconds {:g} of this worker allows",
                                    limits_.seconds);
  };
  const auto assets = [&](const Sha256& digest) -> Result<std::string> {
    LM_RETURN_IF_ERROR(may_continue());
    const Time asked = system_clock().now();
    Result<std::string> bytes = assets_.get(digest);
    fetching += system_clock().now() - asked;
    return bytes;
  };
  const auto images = [&](ByteView bytes, const std::string& name) -> Result<Texels> {
    Result<Texels> texels = decoder_.decode(bytes, name, limits_.image_pixels);
    LM_RETURN_IF_ERROR(may_continue());
    return texels;
  };
  decoder_.set_stop(stop);
  LM_RETURN_IF_ERROR(check_memory(document, assets, decoder_, limits_.bytes));
  LM_ASSIGN_OR_RETURN(std::shared_ptr<const CompiledScene> scene,
                      CompiledScene::compile(document, assets, images,
                                             {.brute_force = method.brute_force,
                                              .max_triangles = limits_.triangles,
                                              .max_texture_bytes = limits_.images_bytes}));
  spdlog::info("scene '{}' is ready after {:.0f} ms, {} KiB", document.name,
               1000 * to_seconds(system_clock().now() - start), scene->bytes() >> 10);
  scenes_.insert(key, scene);
  return scene;
}

}  // namespace lightmill

#include "server/api/api_server.h"

#include <google/protobuf/descriptor.h>
#include <grpc/support/log.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include <unistd.h>

#include <future>
#include <set>

#include "common/base/log.h"
#include "server/api/access_service.h"
#include "server/api/grpc_gate.h"
#include "server/api/health.h"
#include "server/api/render_service.h"
#include "server/api/scaler_service.h"
#include "server/api/worker_streams.h"
#include "server/listen/listener.h"
#include "server/listen/self_check.h"
#include "server/runtime/records.h"
#include "server/store/check_rows.h"

namespace lightmill {
namespace {

/// A packed scene may have 16 MiB; everything else is small.
constexpr int kMaxMessageBytes = 20 << 20;
/// Of one connection; more wait.
constexpr int kMaxConnectionStreams = 1'000;
/// Calls that are under way when the server stops have so long.
constexpr auto kStopPatience = std::chrono::seconds(2);
/// Assets that no job names any more stay for a day: their jobs may still be on their way.
constexpr std::int64_t kSpareAssetAgeSeconds = 24 * 60 * 60;

/// Dead links are found within half a minute, and clients may look for them more eagerly. Whoever has a gigabyte of
/// results on its way takes seconds to answer: it is not dead.
void set_keepalive(grpc::ServerBuilder& builder) {
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, 10'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, 20'000);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, 500);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
}

/// "SERVICE/METHOD" of all that is registered below, health and reflection apart.
std::vector<std::string> served_methods() {
  std::vector<std::string> methods;
  for (const google::protobuf::ServiceDescriptor* service :
       {v1::SubmitJobRequest::descriptor()->file()->FindServiceByName("RenderService"),
        v1::WorkRequest::descriptor()->file()->FindServiceByName("WorkerService"),
        v1::CreateTokenRequest::descriptor()->file()->FindServiceByName("AccessService"),
        externalscaler::ScaledObjectRef::descriptor()->file()->FindServiceByName("ExternalScaler")}) {
    for (int i = 0; i < service->method_count(); ++i) {
      methods.push_back(fmt::format("{}/{}", service->full_name(), service->method(i)->name()));
    }
  }
  return methods;
}

/// The farm's thread may stand still as long as nothing can be stored: who can do so later does not wait for it.
constexpr std::chrono::seconds kFarmPatience(5);

std::set<Sha256> assets_of(const StoredState& state) {
  std::set<Sha256> wanted;
  for (const StoredState::StoredJob& job : state.jobs) {
    const std::vector<Sha256>& named = job.record.spec.settings.assets;
    wanted.insert(named.begin(), named.end());
  }
  return wanted;
}

/// No page's connection outlives its coordinator.
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
    spdlog::info("{} MiB of assets that no job needs are forgotten", freed_bytes >> 20);
  }
}

/// What the gate refuses goes into the log.
void record_refusals(Gate& gate, FarmLoop& loop) {
  gate.set_on_refused([&gate, &loop](const Call& call, const About& about, const Status& status) {
    if (const std::optional<Unwritten> unwritten = gate.may_record_refusal(call, about, status)) {
      (void)loop.post([call, about, status, unwritten = *unwritten](FarmLoop::Turn& turn) {
        record_refusal(turn, call, about, status, unwritten);
      });
    }
  });
}

}  // namespace

/// In the order of their making; each uses only those above it, and gRPC's threads stop first.
struct ApiServer::Parts {
  Parts(const ApiOptions& options, StoredState& state)
      : gate(options.gate, std::move(state.tokens), system_clock()),
        actions(options.log, std::move(state.actions)),
        workers(gate),
        access(gate),
        scaler(gate),
        readiness(options.on_ready) {}
  Gate gate;
  ActionLog actions;
  std::unique_ptr<Store> store;
  std::unique_ptr<AssetStore> assets;
  std::unique_ptr<Coordinator> farm;
  WorkerStreams workers;
  AccessServiceImpl access;
  ScalerServiceImpl scaler;
  Readiness readiness;
  std::unique_ptr<RenderServiceImpl> renders;
  std::unique_ptr<FarmLoop> loop;
  std::unique_ptr<grpc::Server> server;
  std::unique_ptr<Listener> listener;
  std::unique_ptr<SelfCheck> self_check;
  std::unique_ptr<WebServer> web;
};

Result<std::unique_ptr<ApiServer>> ApiServer::start(std::unique_ptr<Store> store, std::unique_ptr<AssetStore> assets,
                                                    const ApiOptions& options) {
  LM_RETURN_IF_ERROR(check_rules(served_methods()));
  LM_ASSIGN_OR_RETURN(StoredState state, store->load());
  std::vector<StoreOp> repairs;
  LM_RETURN_IF_ERROR(take_out_nonsense(state, repairs));
  name_lost_nodes(state);
  if (!repairs.empty()) {
    LM_RETURN_IF_ERROR(store->commit(repairs));
  }
  auto parts = std::make_unique<Parts>(options, state);
  LM_ASSIGN_OR_RETURN(parts->listener, Listener::open(options.listen, "--listen", options.connections));
  forget_others(*assets, assets_of(state));
  spdlog::info("epoch {}, {} jobs in the store", state.epoch, state.jobs.size());
  parts->store = std::move(store);
  parts->assets = std::move(assets);
  const Clock& clock = system_clock();
  const std::string start = fmt::format("epoch {}, process {}", state.epoch, ::getpid());
  const std::vector<JobId> of_pages = jobs_of_pages(state);
  parts->farm = std::make_unique<Coordinator>(options.limits, std::move(state), clock.now());
  parts->renders = std::make_unique<RenderServiceImpl>(*parts->assets, parts->gate, options.notices);
  WorkerStreams& workers = parts->workers;
  Readiness& readiness = parts->readiness;
  parts->loop = std::make_unique<FarmLoop>(
      *parts->farm, parts->actions, *parts->store, clock,
      FarmLoop::Handlers{[&workers](Outgoing message) { workers.send(std::move(message)); },
                         [&workers](SessionId session) { workers.hang_up(session); }, options.on_fatal,
                         [&readiness](bool storing) { readiness.set_storing(storing); }});
  workers.set_loop(*parts->loop, options.limits.max_workers);
  parts->renders->set_loop(*parts->loop);
  parts->access.set_loop(*parts->loop);
  parts->scaler.set_loop(*parts->loop);
  record_refusals(parts->gate, *parts->loop);

  gpr_set_log_function([](gpr_log_func_args* line) { spdlog::debug("grpc: {}", line->message); });
  grpc::EnableDefaultHealthCheckService(true);
  static std::once_flag reflection_once;
  std::call_once(reflection_once, [] { grpc::reflection::InitProtoReflectionServerBuilderPlugin(); });
  grpc::ServerBuilder builder;
  if (parts->gate.asks()) {
    leave_out_reflection(builder);
  }
  Listener::Take take = serve_sockets(builder, server_credentials(options.tls));
  builder.RegisterService(&parts->workers);
  builder.RegisterService(parts->renders.get());
  builder.RegisterService(&parts->access);
  builder.RegisterService(&parts->scaler);
  builder.SetMaxReceiveMessageSize(kMaxMessageBytes);
  builder.SetResourceQuota(grpc::ResourceQuota("lightmill").Resize(options.wire_bytes));
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxConnectionStreams);
  // Reflection alone is served by gRPC's own threads.
  builder.SetSyncServerOption(grpc::ServerBuilder::NUM_CQS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MIN_POLLERS, 1);
  builder.SetSyncServerOption(grpc::ServerBuilder::MAX_POLLERS, 1);
  set_keepalive(builder);
  parts->gate.set_on_met([listener = parts->listener.get()](const std::string& peer, const Identity& caller) {
    return listener->meet(peer, caller);
  });
  parts->server = builder.BuildAndStart();
  if (parts->server == nullptr) {
    (void)parts->loop->stop();
    return internal_error("gRPC does not start; its log says why (--log-level debug)");
  }
  parts->listener->start(std::move(take));
  parts->loop->post_always([start, of_pages](FarmLoop::Turn& turn) {
    record_own(turn, turn.actions.somebody_is_at_work() ? kTakeOver : kStart, start);
    for (const JobId job : of_pages) {
      turn.farm.discard(job, turn.now, turn.unix_ms, turn.effects).IgnoreError();
    }
  });
  auto running = std::unique_ptr<ApiServer>(new ApiServer(std::move(parts)));
  if (options.web) {
    LM_RETURN_IF_ERROR(running->serve_web(*options.web));
  }
  running->parts_->readiness.start(running->parts_->server->GetHealthCheckService());
  running->parts_->self_check = std::make_unique<SelfCheck>(
      *running->parts_->listener, options.tls.given(), clock,
      [&readiness](bool hears) { readiness.set_hearing(hears); }, options.on_fatal);
  return running;
}

Status ApiServer::serve_web(const WebOptions& web) {
  Result<std::unique_ptr<WebServer>> started = WebServer::start(*parts_->loop, parts_->gate, *parts_->assets, web);
  LM_RETURN_IF_ERROR(started.status());
  parts_->web = *std::move(started);
  return ok_status();
}

ApiServer::ApiServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

ApiServer::~ApiServer() {
  if (parts_->server != nullptr) {
    (void)stop();
  }
}

int ApiServer::port() const {
  return parts_->listener->port();
}

void ApiServer::forget_unused_assets() {
  const auto wanted = std::make_shared<std::promise<std::set<Sha256>>>();
  std::future<std::set<Sha256>> answer = wanted->get_future();
  if (parts_->loop->post([wanted](FarmLoop::Turn& turn) { wanted->set_value(turn.farm.assets()); }) &&
      answer.wait_for(kFarmPatience) == std::future_status::ready) {
    forget_others(*parts_->assets, answer.get());
  }
}

void ApiServer::set_space(const std::string& why) {
  parts_->loop->set_space(why);
}

int ApiServer::web_port() const {
  return parts_->web == nullptr ? 0 : parts_->web->port();
}

Status ApiServer::stop() {
  parts_->self_check.reset();
  parts_->web.reset();
  parts_->readiness.stop();
  parts_->loop->stop_waiting();
  parts_->renders->stop();
  parts_->scaler.stop();
  parts_->workers.stop();
  parts_->listener->stop();
  parts_->server->Shutdown(std::chrono::system_clock::now() + kStopPatience);
  parts_->server.reset();
  parts_->loop->post_always(
      [](FarmLoop::Turn& turn) { record_own(turn, kStop, fmt::format("process {}", ::getpid())); });
  return parts_->loop->stop();
}

}  // namespace lightmill

#include "tests/fuzz/rpc_target.h"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/dynamic_message.h>
#include <google/protobuf/stubs/logging.h>
#include <spdlog/spdlog.h>

#include "common/base/check.h"
#include "common/wire/farm_messages.h"
#include "common/wire/scene_proto.h"
#include "lightmill/v1/access_service.pb.h"
#include "lightmill/v1/render_service.pb.h"
#include "lightmill/v1/worker_service.pb.h"
#include "server/store/asset_folder.h"
#include "server/store/sqlite/sqlite_store.h"

namespace lightmill::fuzz {
namespace {

namespace pb = google::protobuf;

constexpr int kMaxReplies = 3;
constexpr std::chrono::milliseconds kTimeout(100), kTimeoutOnALoadedMachine(60'000);

/// Whether the method may wait: for work, for changes of a job, or for a worker that reads the scene.
bool may_wait(const RpcTarget::Method& method) {
  return method.path.ends_with("/Work") || method.path.ends_with("/WatchJob") || method.path.ends_with("/InspectScene");
}

Scene ball() {
  Scene scene;
  scene.materials.emplace_back().name = "grey";
  scene.objects.push_back({"ball", 0, SphereShape{{0, 0, 0}, 1}});
  PointLight light;
  light.position = {0, 3, 0};
  scene.lights.push_back({"lamp", light});
  scene.camera.eye = {0, 0, 5};
  return scene;
}

std::string submission(const std::string& id) {
  JobSpec spec;
  spec.request_id = id;
  spec.name = "fuzz";
  spec.goal.samples = 16;
  spec.settings.scene = pack_scene(ball());
  spec.settings.width = spec.settings.height = 96;
  spec.settings.crop = {0, 0, 96, 96};
  spec.settings.renderer_version = kRendererVersion;
  v1::SubmitJobRequest request;
  to_wire(spec, &request);
  return request.SerializeAsString();
}

grpc::ByteBuffer buffer_of(const std::string& bytes) {
  const grpc::Slice slice(bytes);
  return grpc::ByteBuffer(&slice, 1);
}

/// Waits for the operation that was just started. False if it failed.
bool done(grpc::CompletionQueue& queue) {
  void* tag = nullptr;
  bool ok = false;
  return queue.Next(&tag, &ok) && ok;
}

}  // namespace

RpcTarget::RpcTarget() {
  spdlog::set_level(spdlog::level::off);
  auto store = open_sqlite_store(folder_.path() / "store.sqlite");
  auto assets = open_asset_folder(folder_.path() / "assets", {std::uint64_t{1} << 20, std::uint64_t{1} << 24});
  LM_CHECK(store.ok() && assets.ok());
  RuntimeOptions options;
  options.access.calls.requests_per_second = 1e6;
  options.limits.film_bytes = std::uint64_t{256} << 20;
  auto runtime = Runtime::start(std::move(*store), std::move(*assets), options);
  LM_CHECK(runtime.ok(), "{}", message_of(runtime.status()));
  runtime_ = std::move(*runtime);
  auto server = ApiServer::start(*runtime_, {.listen = "127.0.0.1:0"});
  LM_CHECK(server.ok(), "{}", message_of(server.status()));
  server_ = std::move(*server);
  stub_ = std::make_unique<grpc::GenericStub>(
      grpc::CreateChannel(fmt::format("127.0.0.1:{}", server_->port()), grpc::InsecureChannelCredentials()));
  const auto add = [&](const pb::FileDescriptor* file) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        const pb::MethodDescriptor* const method = file->service(s)->method(m);
        methods_.push_back({fmt::format("/{}/{}", method->service()->full_name(), method->name()),
                            method->input_type()->full_name(), method->output_type()->full_name()});
      }
    }
  };
  add(v1::GetJobRequest::descriptor()->file());
  add(v1::CreateTokenRequest::descriptor()->file());
  add(v1::WorkRequest::descriptor()->file());
  for (int i = 0; i < 3; ++i) {
    const auto submit =
        std::ranges::find_if(methods_, [](const Method& method) { return method.path.ends_with("/SubmitJob"); });
    LM_CHECK(call(*submit, {submission(fmt::format("first {}", i))}).ok(), "a job cannot be submitted");
  }
}

std::string RpcTarget::example(const Method& method) const {
  if (method.path.ends_with("/SubmitJob")) {
    return submission("example");
  }
  if (method.path.ends_with("/Work")) {
    v1::WorkRequest hello;
    to_wire(WorkerMessage(WorkerHello{"w", "h", 1, 2, "class", kRendererVersion, {}, false}), &hello);
    return hello.SerializeAsString();
  }
  if (method.path.ends_with("/ExtendJob")) {
    v1::ExtendJobRequest extend;
    extend.set_id(1);
    extend.set_samples(64);
    return extend.SerializeAsString();
  }
  // Other requests have a few numbers and texts: a first job, a name, a digest.
  pb::DynamicMessageFactory factory;
  const pb::Descriptor* const type = pb::DescriptorPool::generated_pool()->FindMessageTypeByName(method.request);
  const std::unique_ptr<pb::Message> message(factory.GetPrototype(type)->New());
  const pb::Reflection* const reflection = message->GetReflection();
  for (int i = 0; i < type->field_count(); ++i) {
    const pb::FieldDescriptor* const field = type->field(i);
    if (field->is_repeated()) {
      if (field->type() == pb::FieldDescriptor::TYPE_BYTES) {
        reflection->AddString(message.get(), field, std::string(32, 'd'));
      } else if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_ENUM) {
        reflection->AddEnumValue(message.get(), field, 1);
      }
    } else if (field->cpp_type() == pb::FieldDescriptor::CPPTYPE_UINT64) {
      reflection->SetUInt64(message.get(), field, 1);
    } else if (field->type() == pb::FieldDescriptor::TYPE_BYTES) {
      reflection->SetString(message.get(), field, std::string(32, 'd'));
    } else if (field->type() == pb::FieldDescriptor::TYPE_STRING && field->name() != "page_token") {
      reflection->SetString(message.get(), field, "w");
    }
  }
  return message->SerializeAsString();
}

bool RpcTarget::is_message(const std::string& name, std::string_view bytes) {
  static const pb::LogSilencer quiet;
  static pb::DynamicMessageFactory factory;
  const pb::Descriptor* const type = pb::DescriptorPool::generated_pool()->FindMessageTypeByName(name);
  const std::unique_ptr<pb::Message> message(factory.GetPrototype(type)->New());
  return message->ParseFromArray(bytes.data(), static_cast<int>(bytes.size()));
}

grpc::Status RpcTarget::exchange(const Method& method, const std::vector<std::string>& requests,
                                 std::chrono::milliseconds timeout) {
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + timeout);
  context.set_wait_for_ready(true);
  grpc::CompletionQueue queue;
  const auto stream = stub_->PrepareCall(&context, method.path, &queue);
  stream->StartCall(nullptr);
  bool open = done(queue);
  for (const std::string& request : requests) {
    if (open) {
      stream->Write(buffer_of(request), nullptr);
      open = done(queue);
    }
  }
  if (open) {
    stream->WritesDone(nullptr);
    done(queue);
  }
  for (int i = 0; open && i < kMaxReplies; ++i) {
    grpc::ByteBuffer reply;
    stream->Read(&reply, nullptr);
    open = done(queue);
  }
  if (open) {
    context.TryCancel();  // the coordinator has more to send
  }
  grpc::Status status;
  stream->Finish(&status, nullptr);
  done(queue);
  queue.Shutdown();
  return status;
}

grpc::Status RpcTarget::call(const Method& method, const std::vector<std::string>& requests) {
  grpc::Status status = exchange(method, requests, kTimeout);
  if (status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED && !may_wait(method)) {
    status = exchange(method, requests, kTimeoutOnALoadedMachine);
    LM_CHECK(status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED, "{} is not answered", method.path);
  }
  const grpc::StatusCode code = status.error_code();
  LM_CHECK(code != grpc::StatusCode::INTERNAL && code != grpc::StatusCode::UNKNOWN &&
               code != grpc::StatusCode::DATA_LOSS && code != grpc::StatusCode::UNIMPLEMENTED,
           "{} answers with code {}: {}", method.path, static_cast<int>(code), status.error_message());
  LM_CHECK(code == grpc::StatusCode::OK || !status.error_message().empty(), "{} refuses without a reason", method.path);
  return status;
}

}  // namespace lightmill::fuzz

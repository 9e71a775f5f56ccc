// A farm with authentication and its own certificate authority, and calls of every kind to it.
#pragma once

#include <google/protobuf/descriptor.h>
#include <grpc/support/log.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include "common/base/file.h"
#include "common/security/authority.h"
#include "common/security/token.h"
#include "common/wire/farm_messages.h"
#include "common/wire/role_proto.h"
#include "externalscaler/externalscaler.grpc.pb.h"
#include "lightmill/v1/access_service.grpc.pb.h"
#include "lightmill/v1/worker_service.grpc.pb.h"
#include "tests/support/farm.h"

namespace lightmill::test {

inline constexpr std::int64_t kDay = 86'400;

inline std::int64_t now_unix_s() {
  return system_clock().unix_milliseconds() / 1000;
}

inline Validity today() {
  return {now_unix_s() - 300, now_unix_s() + kDay};
}

/// A certificate authority, and a coordinator with its certificate.
class SecureFarm {
 public:
  explicit SecureFarm(const std::vector<std::string>& more_options = {}, const Launch& launch = {"127.0.0.1", {}, {}}) {
    gpr_set_log_function([](gpr_log_func_args*) {});  // it would log each failed handshake
    renew_server(today());
    write("ca.pem", authority_.certificate);
    std::vector<std::string> options{"--tls-cert", path("server.pem"), "--tls-ca", path("ca.pem")};
    options.insert(options.end(), more_options.begin(), more_options.end());
    farm_ = std::make_unique<Farm>(options, launch);
  }
  Farm& farm() const { return *farm_; }
  const KeyAndCertificate& authority() const { return authority_; }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }
  std::string write(const std::string& name, const std::string& text) const {
    EXPECT_TRUE(write_secret_file(path(name), as_byte_view(text), true).ok());
    return path(name);
  }
  KeyAndCertificate person(const std::string& name, Roles roles) const {
    return issue_certificate(authority_, {name, {}, roles}, today()).value();
  }
  void renew_server(const Validity& validity) const {
    const KeyAndCertificate made = issue_certificate(authority_, {"farm", {"127.0.0.1"}, {}}, validity).value();
    write("server.pem", made.certificate + made.key);
  }
  /// Without a certificate the caller is anonymous.
  std::shared_ptr<grpc::Channel> channel(const std::optional<KeyAndCertificate>& who,
                                         grpc::ChannelArguments arguments = {}) const {
    grpc::SslCredentialsOptions options;
    options.pem_root_certs = authority_.certificate;
    if (who) {
      options.pem_private_key = who->key;
      options.pem_cert_chain = who->certificate;
    }
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    return grpc::CreateCustomChannel(farm_->address(), grpc::SslCredentials(options), arguments);
  }

 private:
  TemporaryFolder folder_;
  KeyAndCertificate authority_ = make_authority("Test farm", {now_unix_s() - 300, now_unix_s() + 10 * kDay}).value();
  std::unique_ptr<Farm> farm_;
};

/// Calls a method of any kind with one message, and reads to the end. Of an endless method it reads the first reply.
inline grpc::Status call(const std::shared_ptr<grpc::Channel>& channel, const std::string& method,
                         const std::string& bytes, std::vector<std::string>* replies = nullptr,
                         const std::string& token = "") {
  grpc::GenericStub stub(channel);
  grpc::ClientContext context;
  if (!token.empty()) {
    context.AddMetadata("authorization", "Bearer " + token);
  }
  context.set_deadline(std::chrono::system_clock::now() + kTimeout);
  grpc::CompletionQueue queue;
  const auto stream = stub.PrepareCall(&context, method, &queue);
  const auto done = [&] {
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    return ok;
  };
  const grpc::Slice slice(bytes);
  stream->StartCall(nullptr);
  done();
  stream->Write(grpc::ByteBuffer(&slice, 1), nullptr);
  done();
  stream->WritesDone(nullptr);
  done();
  for (;;) {
    grpc::ByteBuffer reply;
    stream->Read(&reply, nullptr);
    if (!done()) {
      break;
    }
    grpc::Slice whole;
    if (replies != nullptr && reply.DumpToSingleSlice(&whole).ok()) {
      replies->emplace_back(reinterpret_cast<const char*>(whole.begin()), whole.size());
    }
    if (method.ends_with("/StreamIsActive")) {
      context.TryCancel();
    }
  }
  grpc::Status status;
  stream->Finish(&status, nullptr);
  done();
  return status;
}

/// Registers a token as an admin, and returns its text. With the role enrol it can enrol this many workers.
inline std::string token_for(const std::shared_ptr<grpc::Channel>& admin, const std::string& name, Roles roles,
                             std::int64_t until_unix_s = now_unix_s() + kDay, std::uint32_t enrolments = 1) {
  const NewToken token = make_token().value();
  v1::CreateTokenRequest request;
  request.set_id(token.id);
  request.set_sha256(std::string(token.hash.bytes.begin(), token.hash.bytes.end()));
  request.set_name(name);
  to_wire(roles, request.mutable_roles());
  request.set_until_unix_s(until_unix_s);
  if (roles.has(Role::enrol)) {
    request.mutable_enrolment()->set_workers(enrolments);
    request.mutable_enrolment()->set_worker_seconds(kDay);
  }
  grpc::ClientContext context;
  v1::Token made;
  const grpc::Status status = v1::AccessService::NewStub(admin)->CreateToken(&context, request, &made);
  EXPECT_TRUE(status.ok()) << status.error_message();
  EXPECT_EQ(made.made_by(), "root");
  return token.text;
}

/// Uploads the assets of bench_box().
inline void upload_assets(const std::shared_ptr<grpc::Channel>& channel) {
  const auto stub = v1::RenderService::NewStub(channel);
  for (const auto& [digest, bytes] : bench_box().assets) {
    grpc::ClientContext context;
    v1::UploadAssetResponse response;
    const auto writer = stub->UploadAsset(&context, &response);
    v1::UploadAssetRequest request;
    request.set_digest(std::string(digest.bytes.begin(), digest.bytes.end()));
    request.set_chunk(bytes);
    writer->Write(request);
    writer->WritesDone();
    ASSERT_TRUE(writer->Finish().ok());
  }
}

/// Submits a job and waits for its end.
inline std::uint64_t ended_job(const std::shared_ptr<grpc::Channel>& owner) {
  static int number = 0;
  const auto stub = v1::RenderService::NewStub(owner);
  Picture picture;
  picture.side = 64;
  v1::SubmitJobRequest request;
  to_wire(job_of(picture, fmt::format("job {}", ++number)), &request);
  v1::Job job;
  grpc::ClientContext submit, cancel;
  const grpc::Status submitted = stub->SubmitJob(&submit, request, &job);
  EXPECT_TRUE(submitted.ok()) << submitted.error_message();
  v1::CancelJobRequest which;
  which.set_id(job.id());
  EXPECT_TRUE(stub->CancelJob(&cancel, which, &job).ok());
  return job.id();
}

/// Whether `word` is one of `words`, which are separated by spaces.
inline bool has_word(const std::string& words, const std::string& word) {
  return (" " + words + " ").find(" " + word + " ") != std::string::npos;
}

/// "RenderService/GetJob" …, of all services.
inline std::vector<const google::protobuf::MethodDescriptor*> all_methods() {
  std::vector<const google::protobuf::MethodDescriptor*> methods;
  for (const google::protobuf::FileDescriptor* file :
       {v1::SubmitJobRequest::descriptor()->file(), v1::WorkRequest::descriptor()->file(),
        v1::CreateTokenRequest::descriptor()->file(), externalscaler::ScaledObjectRef::descriptor()->file()}) {
    for (int s = 0; s < file->service_count(); ++s) {
      for (int m = 0; m < file->service(s)->method_count(); ++m) {
        methods.push_back(file->service(s)->method(m));
      }
    }
  }
  return methods;
}

}  // namespace lightmill::test

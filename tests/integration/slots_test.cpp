// Limited slots of a farm. When one caller or address takes all it can, others still get theirs.
#include <gtest/gtest.h>
#include <boost/asio/read_until.hpp>
#include <boost/asio/write.hpp>

#include "common/wire/bytes.h"
#include "tests/integration/secure_farm.h"
#include "tests/integration/web_farm.h"
#include "tests/support/recovery.h"

namespace lightmill::test {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

// ---- workers ----

/// A worker that sends a hello, and renders nothing.
class IdleWorker {
 public:
  IdleWorker(const std::shared_ptr<grpc::Channel>& channel, const std::string& name)
      : stub_(v1::WorkerService::NewStub(channel)), stream_(stub_->Work(&context_)) {
    v1::WorkRequest hello;
    to_wire(WorkerHello{name, "host", 1, 1, "class-a", "renderer", {}, false, name}, &hello);
    stream_->Write(hello);
    v1::WorkResponse answer;
    welcome_ = stream_->Read(&answer) && answer.has_welcome();
  }
  ~IdleWorker() {
    context_.TryCancel();
    (void)end();
  }
  IdleWorker(const IdleWorker&) = delete;
  IdleWorker& operator=(const IdleWorker&) = delete;
  bool is_welcome() const { return welcome_; }
  /// Waits until the coordinator ends the stream.
  grpc::Status end() {
    if (!ended_) {
      for (v1::WorkResponse message; stream_->Read(&message);) {
      }
      ended_ = stream_->Finish();
    }
    return *ended_;
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<v1::WorkerService::Stub> stub_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::WorkRequest, v1::WorkResponse>> stream_;
  bool welcome_ = false;
  std::optional<grpc::Status> ended_;
};

TEST(SlotsOfAFarm, WorkersOfOneCertificateLeaveHalfOfAFullFarmToAnother) {
  SecureFarm secure({"--max-workers", "4"});
  const auto flood = secure.channel(secure.person("flood", {Role::worker}));
  std::vector<std::unique_ptr<IdleWorker>> all;
  for (int i = 0; i < 4; ++i) {
    all.push_back(std::make_unique<IdleWorker>(flood, fmt::format("w{}", i)));
    ASSERT_TRUE(all.back()->is_welcome()) << i;
  }
  IdleWorker fifth(flood, "w4");
  EXPECT_EQ(fifth.end().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);

  const auto render = secure.channel(secure.person("render", {Role::worker}));
  std::optional<IdleWorker> first;
  EXPECT_TRUE(recovers("in a farm that others have filled, a worker is welcome",
                       [&] { return first.emplace(render, "first").is_welcome(); }));
  IdleWorker second(render, "second"), third(render, "third");
  EXPECT_TRUE(second.is_welcome());
  EXPECT_EQ(third.end().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << "both have two now";
  for (const std::size_t evicted : {2u, 3u}) {
    const grpc::Status end = all[evicted]->end();
    EXPECT_EQ(end.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
    EXPECT_EQ(end.error_message(), "the farm is full (--max-workers), and makes room for a worker of another caller");
  }
  IdleWorker again(flood, "w3");
  EXPECT_EQ(again.end().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
}

// ---- long calls ----

/// An upload that starts and then stalls.
class SilentUpload {
 public:
  explicit SilentUpload(v1::RenderService::Stub& stub) : writer_(stub.UploadAsset(&context_, &response_)) {
    v1::UploadAssetRequest request;
    request.set_digest(digest_bytes(sha256("these bytes")));
    request.set_chunk("these");
    writer_->Write(request);
  }
  ~SilentUpload() {
    context_.TryCancel();
    (void)end();
  }
  SilentUpload(const SilentUpload&) = delete;
  SilentUpload& operator=(const SilentUpload&) = delete;
  grpc::Status end() {
    if (!ended_) {
      ended_ = writer_->Finish();
    }
    return *ended_;
  }
  bool send_the_rest() {
    v1::UploadAssetRequest request;
    request.set_chunk(" bytes");
    writer_->Write(request);
    writer_->WritesDone();
    return end().ok();
  }

 private:
  grpc::ClientContext context_;
  v1::UploadAssetResponse response_;
  std::unique_ptr<grpc::ClientWriter<v1::UploadAssetRequest>> writer_;
  std::optional<grpc::Status> ended_;
};

TEST(SlotsOfAFarm, SilentUploadsMakeRoomForOthersOfTheirCaller) {
  Farm farm({"--caller-streams", "2"});
  FarmClient client = farm.client();
  SilentUpload first(client.stub()), second(client.stub());
  const auto is_served = [&] { return SilentUpload(client.stub()).send_the_rest(); };
  EXPECT_TRUE(eventually([&] { return !is_served(); })) << "both have their slots";
  EXPECT_TRUE(eventually(is_served));
  const bool first_stays = first.send_the_rest(), second_stays = second.send_the_rest();
  EXPECT_NE(first_stays, second_stays) << "one slot was enough";
  EXPECT_EQ((first_stays ? second : first).end().error_code(), grpc::StatusCode::CANCELLED);
}

TEST(SlotsOfAFarm, UnreadFilmsDoNotBlockOtherFilms) {
  SecureFarm secure;
  grpc::ChannelArguments small_windows;
  small_windows.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto channel = secure.channel(secure.person("ada", {Role::view, Role::submit}), small_windows);
  const auto stub = v1::RenderService::NewStub(channel);
  const KeyAndCertificate worker = secure.person("render", {Role::worker});
  secure.farm().add_worker(1, "w",
                           {"",
                            {},
                            {{"LIGHTMILL_TLS_CA", secure.path("ca.pem")},
                             {"LIGHTMILL_TLS_CERT", secure.write("w.pem", worker.certificate + worker.key)}}});
  upload_assets(channel);
  v1::SubmitJobRequest request;
  to_wire(job_of({.side = 256, .samples = 4}, "one"), &request);  // more than a stream takes without a reader
  v1::Job job;
  grpc::ClientContext submit;
  ASSERT_TRUE(stub->SubmitJob(&submit, request, &job).ok());
  EXPECT_TRUE(eventually([&] {
    grpc::ClientContext context;
    v1::GetJobRequest which;
    which.set_id(job.id());
    return stub->GetJob(&context, which, &job).ok() && job.state() == v1::JOB_STATE_DONE;
  }));
  v1::GetFilmRequest film;
  film.set_id(job.id());
  struct Unread {
    grpc::ClientContext context;
    std::unique_ptr<grpc::ClientReader<v1::GetFilmResponse>> reader;
  };
  std::vector<std::unique_ptr<Unread>> unread;
  for (int i = 0; i < 64; ++i) {
    unread.push_back(std::make_unique<Unread>());
    unread.back()->reader = stub->GetFilm(&unread.back()->context, film);
    unread.back()->reader->WaitForInitialMetadata();
  }
  const auto bob = v1::RenderService::NewStub(secure.channel(secure.person("bob", {Role::view})));
  grpc::ClientContext context;
  const auto reader = bob->GetFilm(&context, film);
  for (v1::GetFilmResponse part; reader->Read(&part);) {
  }
  const grpc::Status status = reader->Finish();
  EXPECT_TRUE(status.ok()) << status.error_message();
  for (const auto& each : unread) {
    each->context.TryCancel();
    (void)each->reader->Finish();
  }
}

// ---- the page ----

/// The first line of the answer to `text`, or empty if the connection ends before.
std::string answer_to(tcp::socket& socket, const std::string& text) {
  boost::system::error_code error;
  asio::write(socket, asio::buffer(text), error);
  std::string answer;
  asio::read_until(socket, asio::dynamic_buffer(answer), "\r\n\r\n", error);
  return error ? "" : answer.substr(0, answer.find('\r'));
}

std::string open_page(const WebFarm& web, tcp::socket& socket) {
  return answer_to(socket, fmt::format("GET /api/v1/live HTTP/1.1\r\nHost: {}\r\nConnection: Upgrade\r\n"
                                       "Upgrade: websocket\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
                                       "Sec-WebSocket-Version: 13\r\n\r\n",
                                       web.host()));
}

TEST(SlotsOfAFarm, PagesOfOneAddressMakeRoomForThoseOfAnother) {
  WebFarm web;
  constexpr int kSlots = 256;
  std::vector<tcp::socket> pages;
  for (int i = 0; i < kSlots; ++i) {  // one address may not have so many, but two may
    pages.push_back(web.connect(i < kSlots * 3 / 4 ? "127.0.0.2" : "127.0.0.3"));
    ASSERT_EQ(open_page(web, pages.back()), "HTTP/1.1 101 Switching Protocols") << i;
  }
  tcp::socket page = web.connect();
  EXPECT_EQ(open_page(web, page), "HTTP/1.1 101 Switching Protocols");
}

TEST(SlotsOfAFarm, HalfSentRequestsDoNotBlockOtherRequestsOfTheirCaller) {
  WebFarm web({}, {"127.0.0.1", {"/bin/sh", "-c", "ulimit -n 256; exec \"$@\"", "sh"}, {}});
  constexpr int kSlots = 24;
  const std::string request = fmt::format("GET /api/v1/farm HTTP/1.1\r\nHost: {}\r\n", web.host());
  std::vector<tcp::socket> flood;
  for (int i = 0; i < kSlots * 3 / 4; ++i) {
    flood.push_back(web.connect());
    ASSERT_EQ(answer_to(flood.back(), request + "\r\n"), "HTTP/1.1 200 OK") << i;
    asio::write(flood.back(), asio::buffer(request));
  }
  tcp::socket caller = web.connect();
  EXPECT_EQ(answer_to(caller, request + "\r\n"), "HTTP/1.1 200 OK");
}

}  // namespace
}  // namespace lightmill::test

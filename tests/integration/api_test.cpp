// The coordinator's API: errors, paging, watching, and exclusive use of a data folder.
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "lightmill/v1/worker_service.grpc.pb.h"
#include "tests/support/farm.h"
#include "tests/support/paths.h"

namespace lightmill::test {
namespace {

Picture small_picture() {
  Picture picture;
  picture.side = 96;
  picture.samples = 8;
  return picture;
}

TEST(Api, UnknownJobsAreNotFound) {
  Farm farm;
  FarmClient client = farm.client();
  v1::Job reply;
  const auto code = [&](auto call, auto request) {
    request.set_id(42);
    grpc::ClientContext context;
    return (client.stub().*call)(&context, request, &reply).error_code();
  };
  using Stub = v1::RenderService::Stub;
  EXPECT_EQ(code(&Stub::GetJob, v1::GetJobRequest()), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(code(&Stub::CancelJob, v1::CancelJobRequest()), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(code(&Stub::PauseJob, v1::PauseJobRequest()), grpc::StatusCode::NOT_FOUND);
  EXPECT_EQ(code(&Stub::ResumeJob, v1::ResumeJobRequest()), grpc::StatusCode::NOT_FOUND);
  grpc::ClientContext watch_context;
  v1::WatchJobRequest watch;
  watch.set_id(42);
  EXPECT_EQ(client.stub().WatchJob(&watch_context, watch)->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
  grpc::ClientContext film_context;
  v1::GetFilmRequest film;
  film.set_id(42);
  EXPECT_EQ(client.stub().GetFilm(&film_context, film)->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST(Api, WorkerStreamsBeyondTheLimitAreRefused) {
  const Farm farm({"--max-workers", "1"});
  const auto stub = v1::WorkerService::NewStub(grpc::CreateChannel(farm.address(), grpc::InsecureChannelCredentials()));
  std::vector<std::unique_ptr<grpc::ClientContext>> contexts;
  std::vector<std::unique_ptr<grpc::ClientReaderWriter<v1::WorkRequest, v1::WorkResponse>>> streams;
  for (int i = 0; i < 17; ++i) {  // --max-workers and 16; none of them sends a hello
    contexts.push_back(std::make_unique<grpc::ClientContext>());
    streams.push_back(stub->Work(contexts.back().get()));
    streams.back()->WaitForInitialMetadata();
  }
  grpc::ClientContext context;
  EXPECT_EQ(stub->Work(&context)->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  for (std::size_t i = 0; i < streams.size(); ++i) {
    contexts[i]->TryCancel();
    EXPECT_EQ(streams[i]->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
}

TEST(Api, AJobWhoseAssetsAreMissingIsRefusedAndNamesOne) {
  Farm farm;
  FarmClient client = farm.client();
  v1::SubmitJobRequest request;
  to_wire(job_of(small_picture(), "one"), &request);
  v1::Job reply;
  grpc::ClientContext context;
  const grpc::Status status = client.stub().SubmitJob(&context, request, &reply);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_NE(status.error_message().find(bench_box().assets.begin()->first.hex()), std::string::npos)
      << status.error_message();

  v1::FindMissingAssetsRequest find;
  for (const auto& [digest, bytes] : bench_box().assets) {
    find.add_digests(digest_bytes(digest));
  }
  const auto missing = [&] {
    grpc::ClientContext find_context;
    v1::FindMissingAssetsResponse found;
    EXPECT_TRUE(client.stub().FindMissingAssets(&find_context, find, &found).ok());
    return found.missing_size();
  };
  EXPECT_EQ(missing(), static_cast<int>(bench_box().assets.size()));
  client.upload_assets();
  EXPECT_EQ(missing(), 0);
}

TEST(Api, AnUploadWithOtherBytesIsRefused) {
  Farm farm;
  FarmClient client = farm.client();
  grpc::ClientContext context;
  v1::UploadAssetResponse response;
  const auto writer = client.stub().UploadAsset(&context, &response);
  v1::UploadAssetRequest request;
  request.set_digest(digest_bytes(sha256("these bytes")));
  request.set_chunk("those bytes");
  writer->Write(request);
  writer->WritesDone();
  EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST(Api, ARepeatedRequestIsOneJobEvenAfterARestart) {
  Farm farm;
  FarmClient client = farm.client();
  const std::uint64_t id = client.submit(small_picture(), "same").id();
  EXPECT_EQ(client.submit(small_picture(), "same").id(), id);
  EXPECT_NE(client.submit(small_picture(), "other").id(), id);
  kill_at_once(farm.server());
  farm.start_server();
  EXPECT_EQ(client.submit(small_picture(), "same").id(), id) << "an acknowledged job is stored";
}

TEST(Api, ListsComeInPages) {
  Farm farm;
  FarmClient client = farm.client();
  for (int i = 0; i < 5; ++i) {
    client.submit(small_picture(), fmt::format("request {}", i));
  }
  std::vector<std::uint64_t> ids;
  v1::ListJobsRequest request;
  request.set_page_size(2);
  int pages = 0;
  do {
    grpc::ClientContext context;
    v1::ListJobsResponse response;
    ASSERT_TRUE(client.stub().ListJobs(&context, request, &response).ok());
    for (const v1::Job& job : response.jobs()) {
      ids.push_back(job.id());
    }
    request.set_page_token(response.next_page_token());
    ++pages;
  } while (!request.page_token().empty());
  EXPECT_EQ(ids, (std::vector<std::uint64_t>{5, 4, 3, 2, 1}));
  EXPECT_EQ(pages, 3);
  request.set_page_token("rubbish");
  grpc::ClientContext context;
  v1::ListJobsResponse response;
  EXPECT_EQ(client.stub().ListJobs(&context, request, &response).error_code(), grpc::StatusCode::INVALID_ARGUMENT);
}

TEST(Api, UnfinishedJobsAreFoundBehindAnyNumberOfEndedOnes) {
  Farm farm;
  FarmClient client = farm.client();
  for (int i = 1; i <= 5; ++i) {
    const std::uint64_t id = client.submit(small_picture(), fmt::format("request {}", i)).id();
    if (i == 2 || i > 3) {
      grpc::ClientContext context;
      v1::CancelJobRequest request;
      request.set_id(id);
      v1::Job job;
      ASSERT_TRUE(client.stub().CancelJob(&context, request, &job).ok());
    }
  }
  v1::ListJobsRequest request;
  request.set_page_size(1);
  request.set_unfinished(true);
  for (const std::uint64_t id : {3, 1}) {
    grpc::ClientContext context;
    v1::ListJobsResponse response;
    ASSERT_TRUE(client.stub().ListJobs(&context, request, &response).ok());
    ASSERT_EQ(response.jobs_size(), 1);
    EXPECT_EQ(response.jobs(0).id(), id);
    EXPECT_EQ(response.next_page_token().empty(), id == 1);
    request.set_page_token(response.next_page_token());
  }
}

TEST(Api, AWatcherSeesEveryTileAndTheEnd) {
  Farm farm;
  FarmClient client = farm.client();
  const Picture picture = small_picture();
  const std::uint64_t id = client.submit(picture).id();
  grpc::ClientContext context;
  v1::WatchJobRequest request;
  request.set_id(id);
  request.set_tiles(true);
  const auto reader = client.stub().WatchJob(&context, request);
  v1::WatchJobResponse response;
  ASSERT_TRUE(reader->Read(&response));
  EXPECT_EQ(response.job().state(), v1::JOB_STATE_QUEUED) << "the first state comes at once, before any worker";
  farm.add_worker(2, "w1");
  std::map<std::pair<int, int>, v1::PreviewTile> newest;
  do {
    for (const v1::PreviewTile& tile : response.tiles()) {
      newest[{tile.rect().x(), tile.rect().y()}] = tile;
    }
  } while (reader->Read(&response));
  EXPECT_TRUE(reader->Finish().ok());
  EXPECT_EQ(response.job().state(), v1::JOB_STATE_DONE);
  ASSERT_EQ(newest.size(), 4u);

  // The last picture shown is the film: the mean of both halves for each pixel.
  const FilmPlanes film = client.film(id);
  for (const auto& [corner, tile] : newest) {
    EXPECT_EQ(tile.samples(), picture.samples);
    const std::vector<float> rgb = floats_from_bytes(tile.rgb()).value();
    const auto pixels = static_cast<std::size_t>(tile.rect().width() * tile.rect().height());
    ASSERT_EQ(rgb.size(), 3 * pixels);
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const std::size_t film_pixel =
          channel * 96 * 96 + static_cast<std::size_t>(tile.rect().y() * 96 + tile.rect().x());
      const float mean = (film.mean_a[film_pixel] + film.mean_b[film_pixel]) / 2;
      EXPECT_NEAR(rgb[channel * pixels], mean, 1e-5f * (1 + mean));
    }
  }
}

TEST(Api, HealthAndReflectionAnswer) {
  Farm farm;
  const auto channel = grpc::CreateChannel(farm.address(), grpc::InsecureChannelCredentials());
  grpc::GenericStub stub(channel);
  const auto call = [&](const std::string& method, const std::string& bytes) {
    grpc::ClientContext context;
    grpc::CompletionQueue queue;
    const grpc::Slice slice(bytes);
    grpc::ByteBuffer request(&slice, 1), reply;
    const auto reader = stub.PrepareUnaryCall(&context, method, request, &queue);
    reader->StartCall();
    grpc::Status status;
    reader->Finish(&reply, &status, nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue.Next(&tag, &ok);
    EXPECT_TRUE(status.ok()) << method << ": " << status.error_message();
    std::vector<grpc::Slice> slices;
    std::string text;
    if (status.ok() && reply.Dump(&slices).ok()) {
      for (const grpc::Slice& each : slices) {
        text.append(reinterpret_cast<const char*>(each.begin()), each.size());
      }
    }
    return text;
  };
  EXPECT_EQ(call("/grpc.health.v1.Health/Check", ""), std::string("\x08\x01", 2)) << "status: SERVING";
  // ServerReflectionRequest{list_services: ""}
  const std::string services =
      call("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo", std::string("\x3a\x00", 2));
  EXPECT_NE(services.find("lightmill.v1.RenderService"), std::string::npos);
  EXPECT_NE(services.find("lightmill.v1.WorkerService"), std::string::npos);
}

TEST(Server, ASecondOneOnTheSameDataIsRefusedWithARemedy) {
  Farm farm;
  BackgroundProcess second({program("lightmill-server"), "--data", farm.data().string(), "--listen", "127.0.0.1:0"},
                           (farm.folder() / "second.log").string());
  EXPECT_EQ(second.wait(), 1);
  EXPECT_NE(farm.log("second").find(farm.data().string()), std::string::npos) << farm.log("second");
  EXPECT_NE(farm.log("second").find("--data"), std::string::npos);
}

TEST(Worker, TriesItsServersInTurn) {
  Farm farm;
  const BackgroundProcess worker(
      {program("lightmill-worker"), "--server", "127.0.0.1:1," + farm.address(), "--threads", "1"},
      (farm.folder() / "worker.log").string());
  FarmClient client = farm.client();
  const std::uint64_t id = client.submit(small_picture()).id();
  EXPECT_EQ(client.wait_until_ended(id).state(), v1::JOB_STATE_DONE);
}

}  // namespace
}  // namespace lightmill::test

// Transfers of assets while the disk is slow.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <future>

#include "common/wire/bytes.h"
#include "lightmill/v1/render_service.grpc.pb.h"
#include "server/api/api_server.h"
#include "server/store/asset_folder.h"
#include "server/store/sqlite/sqlite_store.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

/// Assets on a disk that hangs until it is released.
class SlowAssets final : public AssetStore {
 public:
  SlowAssets(std::unique_ptr<AssetStore> assets, std::shared_future<void> disk, std::atomic<int>& waiting)
      : assets_(std::move(assets)), disk_(std::move(disk)), waiting_(waiting) {}

  std::vector<Sha256> digests() const override { return assets_->digests(); }
  Result<std::uint64_t> size(const Sha256& digest) const override { return assets_->size(digest); }
  Status check_room(const Sha256& digest, const std::string& user, std::uint64_t bytes) const override {
    return assets_->check_room(digest, user, bytes);
  }
  Result<std::unique_ptr<Upload>> start_upload(const Sha256& digest, const std::string& user) override {
    wait();
    return assets_->start_upload(digest, user);
  }
  Status attribute(const Sha256& digest, const std::string& user, UserLimit limit) override {
    return assets_->attribute(digest, user, limit);
  }
  Result<std::unique_ptr<Reader>> open_asset(const Sha256& digest) const override {
    wait();
    return assets_->open_asset(digest);
  }
  std::uint64_t collect(const std::set<Sha256>& wanted, std::int64_t age) override {
    return assets_->collect(wanted, age);
  }
  void forget(const Reader& damaged) override { assets_->forget(damaged); }
  std::uint64_t total_bytes() const override { return assets_->total_bytes(); }

 private:
  void wait() const {
    ++waiting_;
    disk_.wait();
  }
  const std::unique_ptr<AssetStore> assets_;
  const std::shared_future<void> disk_;
  std::atomic<int>& waiting_;
};

TEST(AssetStreams, ASlowDiskHoldsUpNoOtherCall) {
  constexpr int kEach = 24;  // more than gRPC has threads
  const TemporaryFolder folder;
  std::promise<void> disk;
  std::atomic<int> waiting = 0;
  auto runtime = Runtime::start(open_sqlite_store(folder.path() / "store.sqlite").value(),
                                std::make_unique<SlowAssets>(open_asset_folder(folder.path() / "assets", {}).value(),
                                                             disk.get_future().share(), waiting),
                                {});
  ASSERT_TRUE(runtime.ok());
  auto server = ApiServer::start(**runtime, {.listen = "127.0.0.1:0"});
  ASSERT_TRUE(server.ok());
  const auto stub = v1::RenderService::NewStub(
      grpc::CreateChannel(fmt::format("127.0.0.1:{}", (*server)->port()), grpc::InsecureChannelCredentials()));
  const auto upload = [&](const std::string& bytes) {
    grpc::ClientContext context;
    v1::UploadAssetResponse response;
    const auto writer = stub->UploadAsset(&context, &response);
    v1::UploadAssetRequest request;
    request.set_digest(digest_bytes(sha256(bytes)));
    request.set_chunk(bytes);
    writer->Write(request);
    writer->WritesDone();
    return writer->Finish().error_code();
  };
  const auto download = [&](const std::string& bytes) {
    grpc::ClientContext context;
    v1::DownloadAssetRequest request;
    request.set_digest(digest_bytes(sha256(bytes)));
    const auto reader = stub->DownloadAsset(&context, request);
    v1::DownloadAssetResponse response;
    while (reader->Read(&response)) {
    }
    return reader->Finish().error_code();
  };
  std::vector<std::future<grpc::StatusCode>> uploads, downloads;
  for (int i = 0; i < kEach; ++i) {
    uploads.push_back(std::async(std::launch::async, upload, fmt::format("asset {}", i)));
    downloads.push_back(std::async(std::launch::async, download, fmt::format("missing {}", i)));
  }
  EXPECT_TRUE(eventually([&] { return waiting > 0; }));
  for (int i = 0; i < 10; ++i) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTimeout);
    v1::ListJobsResponse jobs;
    EXPECT_TRUE(stub->ListJobs(&context, {}, &jobs).ok());
  }
  disk.set_value();
  for (std::future<grpc::StatusCode>& each : uploads) {
    EXPECT_EQ(each.get(), grpc::StatusCode::OK);
  }
  for (std::future<grpc::StatusCode>& each : downloads) {
    EXPECT_EQ(each.get(), grpc::StatusCode::NOT_FOUND);
  }
  server->reset();
  EXPECT_TRUE((*runtime)->stop().ok());
}

}  // namespace
}  // namespace lightmill::test

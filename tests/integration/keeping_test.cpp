// Storage over years: full disks, jobs that expire, and restored backups.
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>

#include <set>
#include <thread>

#include "common/wire/bytes.h"
#include "common/wire/farm_messages.h"
#include "tests/support/farm.h"
#include "tests/support/memory_group.h"
#include "tests/support/movable_clock.h"
#include "tests/support/paths.h"
#include "tests/support/recovery.h"
#include "tests/support/small_disk.h"
#include "tests/support/sqlite_file.h"

namespace lightmill::test {
namespace {

namespace fs = std::filesystem;

/// For tests that wait for the end of a job. 16 + 4: the film ends as two nodes a tile.
const Picture kSmall{.samples = 20};

bool says(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Open files outlive their folder. So commits would succeed, and be lost with the process.
TEST(Storage, JobsWaitWhileTheDataFolderIsAway) {
  Farm farm({"--reserve-gib", "0"});
  FarmClient client = farm.client();
  const std::uint64_t job = client.submit(kSmall).id();
  const std::filesystem::path away = farm.folder() / "away";
  std::filesystem::rename(farm.data(), away);
  EXPECT_TRUE(eventually([&] {
    return says(client.job(job).reason(), "was moved or deleted while the coordinator ran");
  })) << client.job(job).ShortDebugString();
  std::filesystem::rename(away, farm.data());
  farm.add_worker(1, "w1");
  expect_reference_film(farm.client(), job, kSmall);
}

TEST(Storage, JobsWaitWhenSpaceIsShortAndResumeByThemselves) {
  const SmallDisk disk(160);
  if (!disk.mounted()) {
    GTEST_SKIP() << "cannot mount a disk (needs root)";
  }
  Farm farm({"--reserve-gib", "0.0625"});
  FarmClient client = farm.client();
  Picture picture;
  picture.side = 64;
  picture.samples = 16;
  const std::uint64_t job = client.submit(picture).id();
  disk.fill(130);
  EXPECT_TRUE(eventually([&] { return says(client.job(job).reason(), "waits for space: the disk of "); }))
      << client.job(job).ShortDebugString();
  EXPECT_TRUE(says(client.job(job).reason(), "less than --reserve-gib 0.0625")) << client.job(job).reason();
  v1::SubmitJobRequest request;
  to_wire(job_of(picture, "another"), &request);
  v1::Job another;
  grpc::ClientContext context;
  const grpc::Status refused = client.stub().SubmitJob(&context, request, &another);
  EXPECT_EQ(refused.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_TRUE(says(refused.error_message(), "the farm takes no new jobs")) << refused.error_message();
  v1::UploadAssetRequest asset;
  asset.set_digest(digest_bytes(sha256("asset")));
  asset.set_chunk("asset");
  v1::UploadAssetResponse stored;
  grpc::ClientContext upload_context;
  const auto upload = client.stub().UploadAsset(&upload_context, &stored);
  upload->Write(asset);
  upload->WritesDone();
  EXPECT_TRUE(says(upload->Finish().error_message(), "less than --reserve-gib 0.0625"));
  farm.add_worker(1, "w1");
  disk.make_room();
  expect_reference_film(farm.client(), job, picture);
}

TEST(Storage, FilmsFitIntoTheMemoryThatTheCoordinatorMayUse) {
  const MemoryGroup group(256);
  if (!group.made()) {
    GTEST_SKIP() << "cannot create a control group";
  }
  Farm farm({}, {"127.0.0.1", group.starter(), {}});
  FarmClient client = farm.client();
  farm.add_worker(2, "w1");
  Picture picture;
  picture.side = 4096;  // 384 MiB
  picture.samples = 1;
  picture.method = "preview";
  v1::SubmitJobRequest request;
  to_wire(job_of(picture, "too large"), &request);
  v1::Job none;
  grpc::ClientContext context;
  client.upload_assets();
  const grpc::Status status = client.stub().SubmitJob(&context, request, &none);
  EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << status.error_message();
  EXPECT_TRUE(says(status.error_message(), "more than the coordinator's limit of 0.125 GiB (--films-gib)"))
      << status.error_message();
  picture.side = 2048;  // 96 MiB
  const std::uint64_t job = client.submit(picture).id();
  EXPECT_EQ(client.wait_until_ended(job).state(), v1::JOB_STATE_DONE);
  EXPECT_FALSE(farm.server().wait(std::chrono::milliseconds(0)).has_value()) << farm.server_log();
}

TEST(Storage, FilmsOfEndedJobsMayOutgrowTheMemoryAndEachIsServed) {
  const MemoryGroup group(256);
  if (!group.made()) {
    GTEST_SKIP() << "cannot create a control group";
  }
  Farm farm({}, {"127.0.0.1", group.starter(), {}});
  FarmClient client = farm.client();
  farm.add_worker(2, "w1");
  Picture picture;
  picture.side = 1024;  // 24 MiB
  picture.samples = 1;
  picture.method = "preview";
  const auto lives = [&] { return !farm.server().wait(std::chrono::milliseconds(0)).has_value(); };
  std::vector<std::uint64_t> jobs;
  for (int i = 0; i < 11; ++i) {
    jobs.push_back(client.submit(picture, fmt::format("job {}", i)).id());
    ASSERT_EQ(client.wait_until_ended(jobs.back()).state(), v1::JOB_STATE_DONE);
    ASSERT_TRUE(lives()) << farm.server_log();
  }
  const Hash128 expected = reference_hash(picture);
  const auto fetch_all = [&] {
    std::vector<std::jthread> clients;
    for (std::size_t first = 0; first < 4; ++first) {
      clients.emplace_back([&, first] {
        for (std::size_t i = first; i < jobs.size() && lives(); i += 4) {
          EXPECT_EQ(film_hash(farm.client().film(jobs[i])), expected) << "job " << jobs[i];
        }
      });
    }
  };
  fetch_all();
  ASSERT_TRUE(lives()) << farm.server_log();
  kill_at_once(farm.server());
  farm.start_server();
  fetch_all();
  ASSERT_TRUE(lives()) << farm.server_log();
  picture.samples = 3;
  client.extend(jobs.front(), picture.samples);
  expect_reference_film(farm.client(), jobs.front(), picture);
  EXPECT_TRUE(lives()) << farm.server_log();
}

TEST(Storage, ADamagedNodeOfAnEndedJobIsRenderedAgainOnceItsFilmIsRead) {
  Farm farm;
  FarmClient client = farm.client();
  farm.add_worker(1, "w1");
  const std::uint64_t job = client.submit(kSmall).id();
  ASSERT_EQ(client.wait_until_ended(job).state(), v1::JOB_STATE_DONE);
  farm.server().send(SIGTERM);  // by then the job's end is stored
  ASSERT_EQ(farm.server().wait(), 0);
  SqliteFile(farm.data() / "lightmill.sqlite")
      .execute("UPDATE nodes SET samples = zeroblob(length(samples)) WHERE tile = 2");
  farm.start_server();
  EXPECT_EQ(client.job(job).state(), v1::JOB_STATE_DONE) << "its film was not read";
  (void)client.film(job);
  EXPECT_TRUE(says(farm.server_log(), "of tile 2 are damaged")) << farm.server_log();
  EXPECT_TRUE(says(farm.server_log(), "of its stored nodes were damaged: they are rendered again"))
      << farm.server_log();
  expect_reference_film(farm.client(), job, kSmall);
}

TEST(Storage, DeletingJobsMakesRoom) {
  const SmallDisk disk(480);
  if (!disk.mounted()) {
    GTEST_SKIP() << "cannot mount a disk (needs root)";
  }
  Farm farm({"--reserve-gib", "0.1875"});  // the coordinator checks twice a second, and 60 MiB arrive meanwhile
  FarmClient client = farm.client();
  farm.add_worker(1, "w1");
  Picture large;
  large.side = 1024;
  large.samples = 1;
  large.method = "preview";
  // The farm has the scene's assets after the first job, and takes no upload when space is short.
  const auto submit = [&](const std::string& name) {
    v1::SubmitJobRequest request;
    to_wire(job_of(large, name), &request);
    v1::Job job;
    grpc::ClientContext context;
    const grpc::Status status = client.stub().SubmitJob(&context, request, &job);
    EXPECT_TRUE(status.ok() || says(status.error_message(), "the farm takes no new jobs: it waits for space"))
        << status.error_message();
    return status.ok() ? std::optional(job.id()) : std::nullopt;
  };
  std::vector<std::uint64_t> jobs;
  bool refused = false;
  const auto done = [&](std::uint64_t job) { return client.job(job).state() == v1::JOB_STATE_DONE; };
  bool waits = false;
  while (!waits && jobs.size() < 40) {
    const std::string name = fmt::format("large {}", jobs.size());
    const std::optional<std::uint64_t> job = jobs.empty() ? client.submit(large, name).id() : submit(name);
    if (!job) {  // the last one ended as the space ran short
      waits = refused = true;
      break;
    }
    jobs.push_back(*job);
    EXPECT_TRUE(eventually([&] {
      waits = says(client.job(jobs.back()).reason(), "waits for space: the disk of ");
      return waits || done(jobs.back());
    }));
  }
  ASSERT_TRUE(waits) << "the disk is not full with " << jobs.size() << " jobs";
  ASSERT_GE(jobs.size(), 3u);
  for (std::size_t i = 0; i + 1 < jobs.size(); ++i) {
    v1::DeleteJobRequest request;
    request.set_id(jobs[i]);
    v1::DeleteJobResponse gone;
    grpc::ClientContext context;
    const grpc::Status status = client.stub().DeleteJob(&context, request, &gone);
    EXPECT_TRUE(status.ok()) << status.error_message();
  }
  EXPECT_TRUE(!refused || eventually([&] {
    const std::optional<std::uint64_t> job = submit("after");
    jobs.push_back(job.value_or(jobs.back()));
    return job.has_value();
  }));
  EXPECT_TRUE(eventually([&] { return done(jobs.back()); })) << client.job(jobs.back()).ShortDebugString();
}

TEST(Storage, AFullDiskLosesNothing) {
  const SmallDisk disk(64);
  if (!disk.mounted()) {
    GTEST_SKIP() << "cannot mount a disk (needs root)";
  }
  Farm farm({"--reserve-gib", "0"});
  FarmClient client = farm.client();
  farm.add_worker(1, "w1");
  Picture picture;
  picture.samples = 172;
  const std::uint64_t job = client.submit(picture).id();
  client.wait_for_samples(job, 1);
  disk.fill(64);
  EXPECT_TRUE(eventually([&] {
    const v1::Job now = client.job(job);
    EXPECT_NE(now.state(), v1::JOB_STATE_DONE);
    return now.state() == v1::JOB_STATE_DONE || says(now.reason(), "waits until its state can be stored again");
  })) << client.job(job).ShortDebugString();
  disk.make_room();
  EXPECT_TRUE(recovers("after a full disk, the job continues",
                       [&] { return !says(client.job(job).reason(), "waits until its state can be stored again"); }));
  expect_reference_film(farm.client(), job, picture);
}

TEST(Storage, AFullDiskRefusesJobsAtOnceAndKeepsAcceptedOnes) {
  const SmallDisk disk(64);
  if (!disk.mounted()) {
    GTEST_SKIP() << "cannot mount a disk (needs root)";
  }
  Farm farm({"--reserve-gib", "0"});
  FarmClient client = farm.client();
  std::set<std::uint64_t> jobs{client.submit({}, "first").id()};
  disk.fill(64);
  const auto submit = [&](const std::string& request_id) {
    v1::SubmitJobRequest request;
    to_wire(job_of({}, request_id), &request);
    v1::Job job;
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + kTimeout);
    const grpc::Status status = client.stub().SubmitJob(&context, request, &job);
    if (status.ok()) {
      jobs.insert(job.id());  // the store's file still had room
    }
    return status;
  };
  grpc::Status status;
  std::string taken;
  for (int i = 0; i < 200 && status.ok(); ++i) {
    taken = fmt::format("taken {}", i);
    status = submit(taken);
  }
  EXPECT_EQ(status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << status.error_message();
  EXPECT_TRUE(says(status.error_message(), "has accepted this, but cannot store it yet: ")) << status.error_message();
  EXPECT_TRUE(eventually([&] { return says(submit("refused").error_message(), "so nothing is changed: "); }));
  EXPECT_TRUE(says(submit("refused").error_message(),
                   ". Free space on its disk. Deleting jobs needs space there, too. Try again later"))
      << submit("refused").error_message();
  disk.make_room();
  EXPECT_TRUE(eventually([&] { return submit(taken).ok(); }));
  grpc::ClientContext list;
  v1::ListJobsResponse all;
  ASSERT_TRUE(client.stub().ListJobs(&list, {}, &all).ok());
  EXPECT_EQ(static_cast<std::size_t>(all.jobs_size()), jobs.size());
}

TEST(Storage, JobsThatEndedLongAgoAreDeletedAndOthersStay) {
  const MovableClock clock;
  Farm farm({"--keep-days", "7"}, {"127.0.0.1", {}, clock.environment()});
  FarmClient client = farm.client();
  const std::uint64_t ended = client.submit({}, "ended").id(), waiting = client.submit({}, "waiting").id();
  v1::CancelJobRequest cancel;
  cancel.set_id(ended);
  v1::Job job;
  grpc::ClientContext context;
  ASSERT_TRUE(client.stub().CancelJob(&context, cancel, &job).ok());
  const auto jobs_after = [&](const std::string& passed) {
    clock.move(passed);
    kill_at_once(farm.server());  // it checks once a minute, and at its start
    farm.start_server();
    return client.jobs();
  };
  EXPECT_EQ(jobs_after("+6d"), (std::vector{waiting, ended})) << "newest first";
  EXPECT_EQ(jobs_after("+8d"), std::vector{waiting});
}

TEST(Check, AFolderWithoutAFarmFails) {
  const TemporaryFolder folder;
  const auto check = [&] {
    return run_command({program("lightmill-server"), "check", "--data", folder.path().string()});
  };
  EXPECT_EQ(check().exit_code, 1);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path())) << "nothing is created there";
  std::ofstream(folder.path() / "lightmill.sqlite").close();
  const CommandResult empty = check();
  EXPECT_EQ(empty.exit_code, 1);
  EXPECT_NE(empty.err.find("is empty"), std::string::npos) << empty.err;
}

TEST(Check, ALostDatabaseIsReportedAsTheServerDoes) {
  Farm farm;
  farm.client().submit(kSmall);
  kill_at_once(farm.server());
  for (const char* const name : {"lightmill.sqlite", "lightmill.sqlite-wal", "lightmill.sqlite-shm"}) {
    fs::remove(farm.data() / name);
  }
  std::vector<std::string> command{program("lightmill-server"), "--data", farm.data().string(), "--listen",
                                   "127.0.0.1:0"};
  for (const bool check : {false, true}) {
    if (check) {
      command.emplace_back("check");
    }
    const CommandResult refused = run_command(command);
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_TRUE(says(refused.err, "is empty or gone, but commits were acknowledged. Restore a backup")) << refused.err;
  }
  EXPECT_FALSE(fs::exists(farm.data() / "lightmill.sqlite")) << "nothing is created";
}

TEST(Storage, ADatabaseThatHasLostCommitsIsRefusedUntilTheLossIsAccepted) {
  Farm farm;
  FarmClient client = farm.client();
  farm.add_worker(2, "w1");
  const std::uint64_t first = client.submit(kSmall, "first").id();
  EXPECT_EQ(client.wait_until_ended(first).state(), v1::JOB_STATE_DONE);
  const std::uint64_t lost = client.submit(kSmall, "lost").id();
  EXPECT_EQ(client.wait_until_ended(lost).state(), v1::JOB_STATE_DONE);
  kill_at_once(farm.server());
  // The last commits are cut off, like on a disk that lost them.
  const fs::path journal = farm.data() / "lightmill.sqlite-wal";
  fs::resize_file(journal, fs::file_size(journal) / 2);
  const std::vector<std::string> server{program("lightmill-server"), "--data", farm.data().string(), "--listen",
                                        "127.0.0.1:0"};
  const auto with = [&](const char* word) {
    std::vector<std::string> command = server;
    command.emplace_back(word);
    return command;
  };
  for (const auto& command : {server, with("check")}) {
    const CommandResult refused = run_command(command);
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_TRUE(says(refused.err, "were acknowledged. Jobs up to 2 and their results may be lost")) << refused.err;
    EXPECT_TRUE(says(refused.err, "--accept-loss")) << refused.err;
  }
  const CommandResult accepted = run_command([&] {
    std::vector<std::string> command = with("--accept-loss");
    command.emplace_back("check");
    return command;
  }());
  EXPECT_TRUE(says(accepted.out + accepted.err, "--accept-loss: its last commit is")) << accepted.err;
  farm.start_server();
  EXPECT_EQ(client.submit(kSmall, "another").id(), lost + 1) << "a lost job's number is not reused";
  expect_reference_film(farm.client(), lost + 1, kSmall);
}

TEST(Storage, DamagedAssetsAreForgottenTogetherAndSentAgain) {
  Farm farm;
  FarmClient client = farm.client();
  const Picture picture = kSmall;
  const std::uint64_t waiting = client.submit(picture, "waiting").id();
  std::vector<fs::path> damaged;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(farm.data() / "assets")) {
    if (entry.is_regular_file()) {
      std::fstream file(damaged.emplace_back(entry.path()), std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(-1, std::ios::end);
      file << '\x01';
    }
  }
  ASSERT_GE(damaged.size(), 1u);
  farm.add_worker(1, "w1");
  EXPECT_TRUE(
      eventually([&] { return std::ranges::none_of(damaged, [](const fs::path& file) { return fs::exists(file); }); }));
  EXPECT_TRUE(eventually([&] { return says(client.job(waiting).reason(), "waits for a file that was lost"); }));
  EXPECT_NE(client.job(waiting).state(), v1::JOB_STATE_FAILED) << client.job(waiting).reason();
  client.submit(picture, "with the same files");
  expect_reference_film(farm.client(), waiting, picture);
}

TEST(Storage, AJobWaitsForAnUnreadableAsset) {
  Farm farm;
  FarmClient client = farm.client();
  const Picture picture = kSmall;
  const std::uint64_t job = client.submit(picture).id();
  fs::path asset;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(farm.data() / "assets")) {
    asset = entry.is_regular_file() ? entry.path() : asset;
  }
  const fs::path aside = farm.folder() / "aside";
  fs::rename(asset, aside);
  fs::create_directory(asset);  // it can be opened, but reading fails
  farm.add_worker(1, "w1");
  EXPECT_TRUE(eventually([&] { return says(farm.server_log(), "cannot be read"); })) << farm.server_log();
  EXPECT_NE(client.job(job).state(), v1::JOB_STATE_FAILED) << client.job(job).reason();
  fs::remove(asset);
  fs::rename(aside, asset);
  expect_reference_film(farm.client(), job, picture);
}

TEST(Storage, ACopyOfTheDirectoryIsABackup) {
  Picture picture;
  const TemporaryFolder backup;
  std::uint64_t job = 0;
  {
    Farm farm;
    farm.add_worker(1, "w1");
    job = farm.client().submit(picture).id();
    farm.client().wait_for_samples(job, std::uint64_t{128} * 128 * 32);
    kill_at_once(farm.server());  // like a snapshot of its disk
    fs::copy(farm.data(), backup.path() / "data", fs::copy_options::recursive);
  }
  const CommandResult check =
      run_command({program("lightmill-server"), "check", "--data", (backup.path() / "data").string()});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_TRUE(says(check.out, "all is sound")) << check.out;
  Farm restored;
  kill_at_once(restored.server());
  fs::remove_all(restored.data());
  fs::copy(backup.path() / "data", restored.data(), fs::copy_options::recursive);
  restored.start_server();
  EXPECT_GT(restored.client().job(job).samples_done(), 0u);  // clients may have seen one commit more than is stored
  restored.add_worker(1, "w2");
  expect_reference_film(restored.client(), job, picture);
}

}  // namespace
}  // namespace lightmill::test

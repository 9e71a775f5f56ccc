// A lock between processes.
#include "common/base/file_lock.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

TEST(FileLockTest, HasOneHolderAtATime) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "lock";
  Result<FileLock> first = FileLock::acquire(path, "the thing is in use");
  ASSERT_TRUE(first.ok()) << first.status();
  const Result<FileLock> second = FileLock::acquire(path, "the thing is in use");
  EXPECT_EQ(second.status().code(), StatusCode::kFailedPrecondition);
  EXPECT_EQ(message_of(second.status()), "the thing is in use (process " + std::to_string(::getpid()) + ")");
  {
    const FileLock moved = std::move(*first);
    EXPECT_FALSE(FileLock::acquire(path, "").ok());
  }
  EXPECT_TRUE(FileLock::acquire(path, "").ok());
}

TEST(FileLockTest, AFileOfRootBelongsToTheFoldersOwner) {
  if (::geteuid() != 0) {
    GTEST_SKIP() << "only root can give files away";
  }
  constexpr uid_t kUser = 65534;
  const test::TemporaryFolder folder;
  ASSERT_EQ(::chown(folder.path().c_str(), kUser, kUser), 0);
  const auto path = folder.path() / "lock";
  struct stat info {};
  for (const bool made_before : {false, true}) {
    ASSERT_TRUE(!made_before || ::chown(path.c_str(), 0, 0) == 0);
    ASSERT_TRUE(FileLock::acquire(path, "").ok());
    ASSERT_EQ(::stat(path.c_str(), &info), 0);
    EXPECT_EQ(info.st_uid, kUser) << made_before;
    EXPECT_EQ(info.st_gid, kUser) << made_before;
  }
}

TEST(FileLockTest, AMissingFolderIsNamed) {
  const Result<FileLock> lock = FileLock::acquire("/nowhere/at/all/lock", "");
  EXPECT_EQ(lock.status().code(), StatusCode::kPermissionDenied);
  EXPECT_NE(message_of(lock.status()).find("/nowhere/at/all/lock"), std::string::npos);
}

}  // namespace
}  // namespace lightmill

// A lock between processes.
#include "common/base/file_lock.h"

#include <gtest/gtest.h>
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

TEST(FileLockTest, AMissingFolderIsNamed) {
  const Result<FileLock> lock = FileLock::acquire("/nowhere/at/all/lock", "");
  EXPECT_EQ(lock.status().code(), StatusCode::kPermissionDenied);
  EXPECT_NE(message_of(lock.status()).find("/nowhere/at/all/lock"), std::string::npos);
}

}  // namespace
}  // namespace lightmill

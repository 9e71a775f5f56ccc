// A worker's state folder: one worker at a time, and a token that outlives it.
#include "worker/state/state_folder.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "common/base/file.h"
#include "tests/support/temporary_folder.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

class StateFolderTest : public ::testing::Test {
 protected:
  const test::TemporaryFolder folder_;
  const fs::path root_ = folder_.path() / "made if need be";
};

mode_t mode_of(const fs::path& path) {
  struct stat info {};
  return ::stat(path.c_str(), &info) == 0 ? info.st_mode & 0777u : 0;
}

TEST_F(StateFolderTest, ConcurrentWorkersHaveTheirOwnFolders) {
  std::optional<StateFolder> first = StateFolder::take(root_).value();
  const StateFolder second = StateFolder::take(root_).value();
  EXPECT_EQ(first->path(), root_ / "1");
  EXPECT_EQ(second.path(), root_ / "2");
  first.reset();
  EXPECT_EQ(StateFolder::take(root_)->path(), root_ / "1") << "the one that has left is found again";
  EXPECT_EQ(mode_of(root_ / "1"), 0700u);
}

TEST_F(StateFolderTest, ARequestedTokenStaysTheSameUntilItIsKept) {
  NewToken asked;
  {
    StateFolder state = StateFolder::take(root_).value();
    EXPECT_FALSE(state.has_token());
    asked = state.pending_token().value();
    EXPECT_EQ(asked.hash, sha256(asked.text));
    EXPECT_EQ(token_id(asked.text).value(), asked.id);
    EXPECT_FALSE(state.has_token()) << "the farm has not confirmed it";
  }
  StateFolder state = StateFolder::take(root_).value();
  EXPECT_EQ(state.pending_token()->text, asked.text) << "after a restart";
  ASSERT_TRUE(state.commit_pending_token().ok());
  EXPECT_TRUE(state.has_token());
  EXPECT_EQ(read_file(state.token_file()).value(), asked.text + "\n");
  EXPECT_EQ(mode_of(state.token_file()), 0600u);
  const NewToken next = state.pending_token().value();
  EXPECT_NE(next.text, asked.text) << "the farm has refused the first one";
  EXPECT_EQ(read_file(state.token_file()).value(), asked.text + "\n") << "it stays until there is another";
  ASSERT_TRUE(state.commit_pending_token().ok());
  EXPECT_EQ(read_file(state.token_file()).value(), next.text + "\n");
}

TEST_F(StateFolderTest, ADamagedRequestIsReplaced) {
  StateFolder state = StateFolder::take(root_).value();
  const NewToken asked = state.pending_token().value();
  for (const std::string& damaged : {std::string(), std::string("rubbish\n"), asked.text.substr(1)}) {
    ASSERT_TRUE(write_secret_file(state.path() / "token.asked", as_byte_view(damaged), true).ok());
    EXPECT_TRUE(token_id(state.pending_token()->text).ok());
    EXPECT_NE(state.pending_token()->text, asked.text);
  }
}

TEST_F(StateFolderTest, AWorldWritableFolderIsRefused) {
  fs::create_directories(root_ / "1");
  fs::permissions(root_ / "1", fs::perms::all);
  const Status refused = StateFolder::take(root_).status();
  EXPECT_EQ(refused.code(), StatusCode::kFailedPrecondition);
  EXPECT_NE(message_of(refused).find((root_ / "1").string()), std::string::npos) << refused;
  EXPECT_NE(message_of(refused).find("--state"), std::string::npos) << refused;
}

TEST_F(StateFolderTest, AFileInPlaceOfTheFolderIsNamed) {
  ASSERT_TRUE(write_file_atomically(root_, {}).ok());
  const Status refused = StateFolder::take(root_).status();
  EXPECT_EQ(refused.code(), StatusCode::kPermissionDenied);
  EXPECT_NE(message_of(refused).find(root_.string()), std::string::npos) << refused;
}

TEST_F(StateFolderTest, TheDefaultIsInTheUsersStateFolder) {
  ::setenv("XDG_STATE_HOME", "/state", 1);
  EXPECT_EQ(default_state_root().value(), "/state/lightmill-worker");
  ::unsetenv("XDG_STATE_HOME");
  ::setenv("HOME", "/homes/ada", 1);
  EXPECT_EQ(default_state_root().value(), "/homes/ada/.local/state/lightmill-worker");
  ::unsetenv("HOME");
  EXPECT_NE(message_of(default_state_root().status()).find("--state"), std::string::npos);
}

}  // namespace
}  // namespace lightmill

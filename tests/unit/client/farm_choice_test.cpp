// Which farm a command uses.
#include "client/cli/farm_choice.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace lightmill::cli {
namespace {

class QuickstartFolder {
 public:
  QuickstartFolder() { std::filesystem::create_directories(files()); }
  void write(const char* name, const std::string& text) const { std::ofstream(files() / name) << text << "\n"; }
  std::filesystem::path path() const { return folder_.path(); }

 private:
  std::filesystem::path files() const { return folder_.path() / ".lightmill" / "quickstart"; }
  const test::TemporaryFolder folder_;
};

pid_t ended_process() {
  const pid_t pid = ::fork();
  if (pid == 0) {
    ::_exit(0);
  }
  ::waitpid(pid, nullptr, 0);
  return pid;
}

TEST(FarmChoice, AnotherFarmOfTheFolderIsNamed) {
  const QuickstartFolder clone;
  clone.write("port", "41233");
  clone.write("server.pid", std::to_string(::getpid()));
  const std::string note = other_farm_note(clone.path(), kDefaultServer, "the farm at 127.0.0.1:7350");
  EXPECT_EQ(note, fmt::format("note: this command uses the farm at 127.0.0.1:7350. The farm of {}/quickstart.sh is at "
                              "127.0.0.1:41233: give --server 127.0.0.1:41233 to use it",
                              clone.path().string()));
  EXPECT_EQ(other_farm_note(clone.path() / "build" / "release", kDefaultServer, "the farm at 127.0.0.1:7350"), note)
      << "below the folder, too";
  EXPECT_EQ(other_farm_note(clone.path(), "127.0.0.1:41233", "a local farm"), "") << "it is the one that is used";
}

TEST(FarmChoice, AFolderWithoutARunningFarmNeedsNoNote) {
  const QuickstartFolder clone;
  EXPECT_EQ(other_farm_note(clone.path(), kDefaultServer, "the farm at 127.0.0.1:7350"), "");
  clone.write("port", "41233");
  clone.write("server.pid", std::to_string(ended_process()));
  EXPECT_EQ(other_farm_note(clone.path(), kDefaultServer, "the farm at 127.0.0.1:7350"), "");
  clone.write("server.pid", std::to_string(::getpid()));
  clone.write("port", "none");
  EXPECT_EQ(other_farm_note(clone.path(), kDefaultServer, "the farm at 127.0.0.1:7350"), "");
}

}  // namespace
}  // namespace lightmill::cli

// Fingerprint classes of workers with different image decoders.
#include "worker/render/worker_class.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/methods/fingerprint.h"
#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

TEST(WorkerClass, DependsOnTheTestRenderAndTheImageDecoder) {
  const TemporaryFolder folder;
  const auto decoder = [&](const std::string& name, const std::string& does) {
    const std::filesystem::path program = folder.path() / name;
    std::ofstream(program) << "#!/bin/sh\n" << does << "\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    return worker_class(program);
  };
  const std::string one = decoder("one", "echo 0123456789abcdef"), same = decoder("same", "echo 0123456789abcdef"),
                    other = decoder("other", "echo 0123456789abcdee"), broken = decoder("broken", "exit 1"),
                    missing = worker_class(folder.path() / "missing");
  EXPECT_EQ(one.size(), 16u);
  EXPECT_EQ(one, same);
  EXPECT_NE(one, other);
  EXPECT_NE(one, broken);
  EXPECT_EQ(broken, missing);
  EXPECT_NE(one, fingerprint_class());
}

}  // namespace
}  // namespace lightmill::test

// `verify`: anyone with a picture and its scene can check the picture.
#include "client/cli/film_fetch.h"
#include "common/base/file.h"
#include "common/farm/job.h"
#include "common/image/exr.h"
#include "common/image/picture_file.h"
#include "tests/integration/cli/cli_fixture.h"

namespace lightmill::test {
namespace {

class VerifyTest : public SharedFarmTest {
 protected:
  void SetUp() override {
    on_farm({"render", scene_, "--size", "150x100", "--spp", "5", "--layers", "albedo,depth", "--method", "path", "-o",
             path_});
  }
  nlohmann::json verify(int exit_code, const std::string& scene, const std::string& share = "all") const {
    return on_farm({"verify", path_, scene, "--share", share}, exit_code);
  }

  const std::string scene_ = scene("cornell-bench-blocks.json");
  const std::string path_ = file("picture.exr");
};

TEST_F(VerifyTest, APictureMatchesItsReceipt) {
  const nlohmann::json all = verify(0, scene_);
  EXPECT_EQ(all["tiles"], 6);
  EXPECT_EQ(all["verified"], 6);
  EXPECT_EQ(json({"verify", path_, scene_, "--local", "--share", "1%"})["verified"], 1);
}

TEST_F(VerifyTest, WrongPixelsUnderAConsistentReceiptAreFound) {
  // A forger can rewrite the file so that everything fits except the pixels.
  FilmPicture picture = load_film_picture(path_).value();
  picture.half_a[40 * 150 + 70] += 0.25f;
  picture.receipt.film_hash = film_hash_of(picture).hex();
  ASSERT_TRUE(cli::write_outputs(picture, {{path_}}).ok());
  const nlohmann::json result = verify(1, scene_);
  ASSERT_EQ(result["wrong"].size(), 1u) << result.dump();
  EXPECT_EQ(result["wrong"][0]["x"], 64);
  EXPECT_EQ(result["wrong"][0]["y"], 0);
  EXPECT_NE(result["wrong"][0]["differs"].get<std::string>().find("A.R (1 values)"), std::string::npos);
}

TEST_F(VerifyTest, DamageAndOtherScenesAreFoundBeforeAnythingIsRendered) {
  const std::string whole = read_file(path_).value();
  ASSERT_TRUE(write_file_atomically(path_, as_byte_view(whole.substr(0, whole.size() / 2))).ok());
  verify(1, scene_);
  std::string changed = whole;
  const std::size_t seed = changed.find("lightmill.method");
  ASSERT_NE(seed, std::string::npos);
  const std::size_t value = changed.find("path", seed);
  changed.replace(value, 4, "pAth");
  ASSERT_TRUE(write_file_atomically(path_, as_byte_view(changed)).ok());
  verify(1, scene_);
  ASSERT_TRUE(write_file_atomically(path_, as_byte_view(whole)).ok());
  verify(1, scene("cornell-bench-balls.json"));
}

TEST_F(VerifyTest, OnlyTheFileOfAMixedPictureIsChecked) {
  const CommandResult rendered = lightmill({"render", scene_, "--size", "64x64", "--spp", "1", "--method", "path",
                                            "--allow-mixed", "-o", path_, "--server", server()});
  ASSERT_EQ(rendered.exit_code, 0) << rendered.err;
  EXPECT_NE(rendered.err.find("its bits cannot be reproduced"), std::string::npos) << rendered.err;
  EXPECT_EQ(rendered.out.find("cannot be reproduced"), std::string::npos) << rendered.out;
  EXPECT_EQ(load_film_picture(path_).value().receipt.fingerprint_class, kMixedClass);
  const CommandResult checked = lightmill({"verify", path_, scene_, "--share", "all", "--server", server()});
  EXPECT_EQ(checked.exit_code, 2);
  EXPECT_NE(checked.err.find("the file is unchanged"), std::string::npos) << checked.err;
  EXPECT_NE(checked.err.find("--allow-mixed"), std::string::npos) << checked.err;
}

}  // namespace
}  // namespace lightmill::test

#include "server/web/page_files.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/temporary_folder.h"

namespace lightmill::test {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

TEST(PageFiles, OnlyFilesOfTheFolderAreFound) {
  const TemporaryFolder folder;
  const fs::path pages = folder.path() / "pages";
  write(folder.path() / "secret.json", "{}");
  write(pages / "index.html", "<p>");
  write(pages / "assets" / "a.js", "1");
  write(pages / "assets" / "a.js.gz", "packed");
  write(pages / "notes.txt", "of no known type");
  const Result<PageFiles> files = PageFiles::load(pages);
  ASSERT_TRUE(files.ok()) << files.status();
  ASSERT_NE(files->find("/"), nullptr);
  EXPECT_EQ(*files->find("/")->bytes, "<p>");
  EXPECT_EQ(files->find("/")->content_type, "text/html; charset=utf-8");
  EXPECT_FALSE(files->find("/")->immutable);
  ASSERT_NE(files->find("/assets/a.js"), nullptr);
  EXPECT_EQ(*files->find("/assets/a.js")->gzip, "packed");
  EXPECT_TRUE(files->find("/assets/a.js")->immutable);
  for (const char* path : {"", "/assets", "/assets/", "/notes.txt", "/assets/a.js.gz", "/../secret.json",
                           "/assets/../../secret.json", "/%2e%2e/secret.json", "//index.html"}) {
    EXPECT_EQ(files->find(path), nullptr) << path;
  }
}

TEST(PageFiles, PagesAreFoundWithoutTheirExtension) {
  const TemporaryFolder folder;
  write(folder.path() / "index.html", "<p>");
  write(folder.path() / "docs.html", "<h1>");
  write(folder.path() / "docs" / "guide" / "render.html", "<h2>");
  const Result<PageFiles> files = PageFiles::load(folder.path());
  ASSERT_TRUE(files.ok()) << files.status();
  for (const auto& [path, text] :
       {std::pair{"/docs", "<h1>"}, {"/docs/guide/render", "<h2>"}, {"/docs/guide/render.html", "<h2>"}}) {
    ASSERT_NE(files->find(path), nullptr) << path;
    EXPECT_EQ(*files->find(path)->bytes, text);
  }
  for (const char* path : {"/index", "/docs/", "/docs/guide"}) {
    EXPECT_EQ(files->find(path), nullptr) << path;
  }
}

TEST(PageFiles, AMissingPageIsReportedWithItsBuildTarget) {
  const TemporaryFolder folder;
  const Result<PageFiles> files = PageFiles::load(folder.path());
  EXPECT_EQ(files.status().code(), StatusCode::kNotFound);
  EXPECT_NE(message_of(files.status()).find("lightmill-web"), std::string::npos);
}

}  // namespace
}  // namespace lightmill::test

#include "server/web/page_files.h"

#include <algorithm>
#include <array>

#include "common/base/digest.h"
#include "common/base/file.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxFiles = 500;
constexpr std::uint64_t kMaxBytes = std::uint64_t{16} << 20;

struct Type {
  std::string_view extension, content_type;
};
constexpr std::string_view kHtml = ".html";
constexpr std::array<Type, 7> kTypes{{{kHtml, "text/html; charset=utf-8"},
                                      {".js", "text/javascript; charset=utf-8"},
                                      {".css", "text/css; charset=utf-8"},
                                      {".json", "application/json"},
                                      {".svg", "image/svg+xml"},
                                      {".png", "image/png"},
                                      {".webmanifest", "application/manifest+json"}}};

bool is_file(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored);
}

}  // namespace

Result<PageFiles> PageFiles::load(const fs::path& folder) {
  std::error_code error;
  if (!is_file(folder / "index.html")) {
    return not_found("there is no {}: the page is built with `cmake --build … --target lightmill-web`",
                     (folder / "index.html").string());
  }
  PageFiles pages;
  fs::recursive_directory_iterator at(folder, error);
  for (; !error && at != fs::recursive_directory_iterator(); at.increment(error)) {
    const fs::directory_entry& entry = *at;
    const auto type = std::ranges::find(kTypes, entry.path().extension().string(), &Type::extension);
    if (type == kTypes.end() || !is_file(entry.path())) {
      continue;
    }
    if (pages.files_.size() == kMaxFiles) {
      return invalid_argument("{} has more than {} files: is it the page's folder?", folder.string(), kMaxFiles);
    }
    LM_ASSIGN_OR_RETURN(std::string bytes, read_file(entry.path(), kMaxBytes));
    PageFile file;
    file.content_type = type->content_type;
    file.etag = fmt::format("\"{}\"", sha256(bytes).hex().substr(0, 32));
    file.bytes = std::make_shared<const std::string>(std::move(bytes));
    if (const fs::path packed = entry.path().string() + ".gz"; is_file(packed)) {
      LM_ASSIGN_OR_RETURN(std::string gzip, read_file(packed, kMaxBytes));
      file.gzip = std::make_shared<const std::string>(std::move(gzip));
    }
    const std::string path = fmt::format("/{}", fs::relative(entry.path(), folder).generic_string());
    file.immutable = path.starts_with("/assets/");
    if (path == "/index.html") {
      pages.files_.emplace("/", file);
    } else if (path.ends_with(kHtml)) {
      pages.files_.emplace(path.substr(0, path.size() - kHtml.size()), file);
    }
    pages.files_.emplace(path, std::move(file));
  }
  return error ? Result<PageFiles>(unavailable("{}: {}", folder.string(), error.message())) : std::move(pages);
}

const PageFile* PageFiles::find(std::string_view path) const {
  const auto at = files_.find(path);
  return at == files_.end() ? nullptr : &at->second;
}

}  // namespace lightmill

// Files of the page, read once at the start. Requests are looked up here, never on the disk.
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "server/web/change_log.h"

namespace lightmill {

struct PageFile {
  SharedBytes bytes;
  SharedBytes gzip;  ///< compressed; null if there is no such file
  std::string content_type;
  std::string etag;
  bool immutable = false;  ///< the name changes with the content
};

class PageFiles {
 public:
  /// Loads all files of known types in the folder. "index.html" is also "/", and "docs.html" is also
  /// "/docs". NOT_FOUND says how to build the page.
  static Result<PageFiles> load(const std::filesystem::path& folder);
  /// `path` begins with '/'. Null if there is no such file.
  const PageFile* find(std::string_view path) const;

 private:
  std::map<std::string, PageFile, std::less<>> files_;
};

}  // namespace lightmill

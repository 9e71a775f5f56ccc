// The files of the page, read once at the start: what a request names is looked up here and never on the disk.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "common/base/status.h"
#include "server/web/change_log.h"

namespace lightmill {

struct PageFile {
  SharedBytes bytes;
  SharedBytes gzip;  ///< the same compressed; null if there is no such file
  std::string content_type;
  std::string etag;
  bool immutable = false;  ///< its name changes with its content
};

class PageFiles {
 public:
  /// Whatever there is of known types in the folder, "index.html" as "/" too. NOT_FOUND says how to build it.
  static Result<PageFiles> load(const std::filesystem::path& folder);
  /// `path` begins with '/'; null if there is no such file.
  const PageFile* find(std::string_view path) const;

 private:
  std::map<std::string, PageFile, std::less<>> files_;
};

}  // namespace lightmill
